#pragma once
// Numbers of many neighbouring streams at once.

#include <cstdint>
#include <span>

#include "core/random.h"

namespace touchstone {

/// For each k: one[k] and other[k] are the numbers 2 `number` and 2 `number` + 1 (from 0) that uniform() of
/// RandomStream(seed, first_index + k, purpose) gives, bit for bit, in a fifth of the time.
/// @pre both are of one size
void uniform_pairs(std::uint64_t seed, std::uint64_t first_index, Purpose purpose, std::uint32_t number,
                   std::span<double> one, std::span<double> other);

}  // namespace touchstone
