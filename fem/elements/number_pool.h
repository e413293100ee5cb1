#pragma once
// Memory of an elimination's fronts.

#include <sys/mman.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

namespace touchstone::fem {

/// Memory for doubles, straight from the system: pages that are never touched are never there.
class Numbers {
 public:
  Numbers() = default;
  explicit Numbers(std::size_t count) : count_(count) {  ///< zeros. @throws std::bad_alloc
    void* const memory = mmap(nullptr, bytes(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    data_ = static_cast<double*>(memory);
  }
  Numbers(Numbers&& other) noexcept  ///< `other` has none then
      : data_(std::exchange(other.data_, nullptr)), count_(std::exchange(other.count_, 0)) {}
  Numbers& operator=(Numbers&& other) noexcept {
    std::swap(data_, other.data_);
    std::swap(count_, other.count_);
    return *this;
  }
  ~Numbers() {
    if (data_ != nullptr) munmap(data_, bytes());
  }

  double* get() const { return data_; }
  /// The same memory for numbers of another precision.
  template <typename Real>
  Real* as() const {
    return reinterpret_cast<Real*>(data_);
  }
  std::size_t bytes() const { return count_ * sizeof(double); }

 private:
  double* data_ = nullptr;
  std::size_t count_ = 0;
};

/// Memory that is used again and again: to take fresh pages for each front cost a fifth of the time.
class NumberPool {
 public:
  /// At least `count` doubles of any value.
  Numbers take(std::size_t count) {
    const std::size_t size = std::bit_ceil(std::max(count, kSmallest));
    {
      const std::lock_guard lock(gate_);
      auto& kept = free_[static_cast<std::size_t>(std::countr_zero(size))];
      if (!kept.empty()) {
        Numbers numbers = std::move(kept.back());
        kept.pop_back();
        return numbers;
      }
    }
    return Numbers(size);
  }
  void give_back(Numbers numbers) {  ///< for the next who takes as many
    if (numbers.get() == nullptr || numbers.bytes() > kLargestKept) return;
    const std::lock_guard lock(gate_);
    free_[static_cast<std::size_t>(std::countr_zero(numbers.bytes() / sizeof(double)))].push_back(std::move(numbers));
  }

 private:
  static constexpr std::size_t kSmallest = std::size_t{1} << 14;
  static constexpr std::size_t kLargestKept = std::size_t{1} << 26;
  std::mutex gate_;
  std::array<std::vector<Numbers>, 64> free_;
};

}  // namespace touchstone::fem
