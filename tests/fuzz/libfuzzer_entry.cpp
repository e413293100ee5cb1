#include <pthread.h>
#include <sanitizer/common_interface_defs.h>

#include <csignal>
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  // What ends a process that core/isolated_call.h started is an Error for us, so it mustn't be kept as a find.
  pthread_atfork(nullptr, nullptr, [] {
    __sanitizer_set_death_callback(nullptr);
    for (const int signal : {SIGBUS, SIGFPE, SIGILL}) std::signal(signal, SIG_DFL);
  });
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  touchstone::fuzz::reads({reinterpret_cast<const char*>(data), size});
  return 0;
}
