#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace touchstone {

/// How long work reports its progress: `stage` is what is being done, `done` of `total` steps of it (0: unknown). May
/// be called from several threads at once. An empty function means that nobody listens.
using Progress = std::function<void(const std::string& stage, std::int64_t done, std::int64_t total)>;

}  // namespace touchstone
