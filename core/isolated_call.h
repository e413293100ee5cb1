#pragma once

#include <functional>
#include <string>

namespace touchstone {

/// Runs `work` in a child process and returns what it returned, so that a library that ends the process on bad input,
/// or never comes back, ends only the child. The child sees a copy of this process' memory; nothing that it changes
/// comes back but the string, and what it prints to standard error is lost. Other threads don't run in it: `work` must
/// not use what they might hold locked (memory may be allocated: glibc's allocator is safe over fork(), but not that of
/// AddressSanitizer, under which no other thread may allocate at the moment of the call).
/// @throws Error with the message of an Error that `work` threw; or, as the second half of a sentence, that the child
/// was ended by a signal, took more than `cpu_seconds` of computing or `wall_seconds` of waiting, or couldn't be
/// started
std::string isolated_call(const std::function<std::string()>& work, int cpu_seconds, int wall_seconds);

}  // namespace touchstone
