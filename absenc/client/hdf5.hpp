// SPDX-License-Identifier: Apache-2.0
// Recordings in HDF5, for programs that include this header and link absenc::hdf5.
#pragma once

namespace absenc::client {

/// Lets `Recording` write files that end in .h5 or .hdf5. Returns true.
bool use_hdf5();

namespace detail {
inline const bool hdf5_in_use = use_hdf5();
}  // namespace detail

}  // namespace absenc::client
