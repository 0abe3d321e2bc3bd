// SPDX-License-Identifier: Apache-2.0
// Names and settings of absenc.toml, for programs that include this header and link absenc::configuration.
#pragma once

namespace absenc::client {

/// Lets `open` and all functions that take an encoder read absenc.toml. Returns true.
bool use_configuration();

namespace detail {
inline const bool configuration_in_use = use_configuration();
}  // namespace detail

}  // namespace absenc::client
