// SPDX-License-Identifier: Apache-2.0
// The extension module absenc._absenc, which absenc/*.py is based on.
#include "absenc/client/configuration.hpp"  // names in absenc.toml work only in programs that include this header
#include "python/src/bind.hpp"
#ifdef ABSENC_FTDI
#include "absenc/os/ftdi.hpp"  // FTDI chips can be opened as ports only in programs that include this header
#endif
#ifdef ABSENC_GPIO
#include "absenc/os/gpio.hpp"  // ports can send pulses on GPIO lines only in programs that include this header
#endif
#ifdef ABSENC_HDF5
#include "absenc/client/hdf5.hpp"  // recordings can be written in HDF5 only in programs that include this header
#endif

PYBIND11_MODULE(_absenc, module) {
  using namespace absenc::python;
  register_exceptions();
  bind_sample(module);
  bind_encoder(module);
  bind_emulation(module);
  bind_identify(module);
  bind_verdicts(module);
  bind_protocol(module);
  bind_decode(module);
  module.attr("__version__") = ABSENC_VERSION;
}
