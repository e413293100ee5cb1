#include "core/uniform_pairs.h"

#include <algorithm>

#include "core/error.h"
#include "core/wide_clones.h"

namespace touchstone {
namespace {

constexpr int kLanes = 64;

/// 53 bits of two words as a share of 2^53. A vector has no conversion from unsigned words: by the sign.
inline double share_of(std::uint32_t high, std::uint32_t low) {
  const double upper = static_cast<double>(static_cast<std::int32_t>(high ^ 0x80000000u)) + 0x1.0p31;
  return (upper * 0x1.0p21 + static_cast<double>(static_cast<std::int32_t>(low >> 11))) * 0x1.0p-53;
}

/// Philox4x32-10 [Salmon2011] of kLanes counters that differ in the index alone.
TS_WIDE_CLONES void pairs(std::uint64_t seed, std::uint64_t first_index, std::uint32_t purpose, std::uint32_t number,
                          double* one, double* other) {
  alignas(64) std::uint32_t a[kLanes], b[kLanes], c[kLanes], d[kLanes];
  for (int k = 0; k < kLanes; ++k) {
    const std::uint64_t index = first_index + static_cast<std::uint64_t>(k);
    a[k] = number;
    b[k] = purpose;
    c[k] = static_cast<std::uint32_t>(index);
    d[k] = static_cast<std::uint32_t>(index >> 32);
  }
  auto key = static_cast<std::uint32_t>(seed);
  auto other_key = static_cast<std::uint32_t>(seed >> 32);
  for (int round = 0; round < 10; ++round) {
    for (int k = 0; k < kLanes; ++k) {
      const std::uint64_t left = std::uint64_t{0xd2511f53u} * a[k];
      const std::uint64_t right = std::uint64_t{0xcd9e8d57u} * c[k];
      a[k] = static_cast<std::uint32_t>(right >> 32) ^ b[k] ^ key;
      b[k] = static_cast<std::uint32_t>(right);
      c[k] = static_cast<std::uint32_t>(left >> 32) ^ d[k] ^ other_key;
      d[k] = static_cast<std::uint32_t>(left);
    }
    key += 0x9e3779b9u;
    other_key += 0xbb67ae85u;
  }
  for (int k = 0; k < kLanes; ++k) one[k] = share_of(a[k], b[k]);
  for (int k = 0; k < kLanes; ++k) other[k] = share_of(c[k], d[k]);
}

}  // namespace

void uniform_pairs(std::uint64_t seed, std::uint64_t first_index, Purpose purpose, std::uint32_t number,
                   std::span<double> one, std::span<double> other) {
  TS_ASSERT(one.size() == other.size());
  const auto number_of_purpose = static_cast<std::uint32_t>(purpose);
  std::size_t k = 0;
  for (; k + kLanes <= one.size(); k += kLanes) {
    pairs(seed, first_index + k, number_of_purpose, number, one.data() + k, other.data() + k);
  }
  if (k == one.size()) return;
  double last_one[kLanes], last_other[kLanes];
  pairs(seed, first_index + k, number_of_purpose, number, last_one, last_other);
  std::copy_n(last_one, one.size() - k, one.data() + k);
  std::copy_n(last_other, one.size() - k, other.data() + k);
}

}  // namespace touchstone
