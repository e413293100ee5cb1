#include "fem/elements/quasi_definite_schur.h"

#include <sys/mman.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <mutex>
#include <new>
#include <utility>
#include <vector>

#include "core/error.h"
#include "fem/elements/front.h"
#include "fem/elements/row_skeleton.h"

extern "C" {
void openblas_set_num_threads(int);
int openblas_get_num_threads(void);
}

namespace touchstone::fem {
namespace {

/// Memory for doubles, straight from the system: pages that are never touched are never there.
class Numbers {
 public:
  Numbers() = default;
  explicit Numbers(std::size_t count) : count_(count) {
    void* const memory = mmap(nullptr, bytes(), PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) throw std::bad_alloc();
    data_ = static_cast<double*>(memory);
  }
  Numbers(Numbers&& other) noexcept
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
  std::size_t bytes() const { return count_ * sizeof(double); }

 private:
  double* data_ = nullptr;
  std::size_t count_ = 0;
};

/// Memory that is used again and again: to take fresh pages for each front cost a fifth of the time.
class Pool {
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
  void give_back(Numbers numbers) {
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

/// What a group of unknowns leaves to its parent: the rows of its front that weren't eliminated, and the lower half of
/// their Schur complement, column after column.
struct Update {
  std::vector<int> rows;
  Numbers values;
};

struct Group {
  int first = 0;     ///< its pivots' places are first .. first + positive + negative - 1
  int positive = 0;  ///< come before the negative ones
  int negative = 0;
  std::vector<int> children;
  std::vector<int> rows;    ///< places of its front: the pivots, then what they meet later, rising
  std::size_t entries = 0;  ///< its part of the entries sorted by group
  std::size_t entries_end = 0;
  double work = 0.0;  ///< operations of its branch
  std::ptrdiff_t size = 0;  ///< of its front
  std::ptrdiff_t left = 0;  ///< rows of what it leaves to its parent
};

/// From so many rows of the border on a front's are compressed.
constexpr std::ptrdiff_t kLeastCompressed = 256;
/// Of the later unknowns: fewer rows than that aren't combinations of much fewer.
constexpr double kFewLater = 0.45;
/// Parts of the rows; where more are needed they are left as they are.
constexpr double kWorthCompressing = 0.8;
/// Of the root of the largest diagonal entry: what compressing a front's rows leaves out, its later unknowns being
/// scaled to a diagonal of one.
constexpr double kLeftOut = 1e-4;

/// What compressing at one group took out of the elimination.
struct Compressed {
  std::vector<int> members;  ///< places of the border, then of basis vectors
  Eigen::MatrixXf core;
  Eigen::MatrixXd whole;  ///< rows that stay whole x members
  RowSkeleton skeleton;
};

class Elimination {
 public:
  /// `whole`: of the border's last unknowns, whose rows stay as they are while the others' are compressed.
  Elimination(const SymmetricEntries& matrix, int last, const EliminationTree& tree, std::optional<int> whole = {})
      : matrix_(matrix),
        free_(matrix.size - last),
        whole_from_(matrix.size - whole.value_or(0)),
        compresses_(whole.has_value()),
        groups_(tree.parent.size()) {
    place_unknowns(tree);
    sort_entries(tree);
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      if (tree.parent[g] < 0) {
        roots_.push_back(static_cast<int>(g));
      } else {
        TS_ASSERT(tree.parent[g] > static_cast<int>(g));
        groups_[tree.parent[g]].children.push_back(static_cast<int>(g));
      }
    }
    for (Group& group : groups_) {
      find_rows(group);
      group.size = std::ssize(group.rows);
      group.left = group.size - group.positive - group.negative;
    }
    if (!compresses_) return;
    compressed_.resize(groups_.size());
    // Basis vectors have places behind all unknowns.
    int next = matrix.size;
    for (const Group& group : groups_) {
      first_basis_.push_back(next);
      next += static_cast<int>(group.rows.end() - std::lower_bound(group.rows.begin(), group.rows.end(), free_));
    }
  }

  /// The Schur complement's lower half; false if a pivot failed.
  bool run(Eigen::MatrixXd& schur) {
    for (const int root : roots_) {
      const Update update = eliminate(root);
      if (failed_) return false;
      const auto size = static_cast<std::ptrdiff_t>(update.rows.size());
      const double* value = update.values.get();
      for (std::ptrdiff_t j = 0; j < size; ++j) {
        for (std::ptrdiff_t i = j; i < size; ++i) schur(update.rows[i] - free_, update.rows[j] - free_) += *value++;
      }
    }
    for (std::size_t k = border_entries_; k < sorted_.size(); ++k) {
      const auto [row, column] = places_of(sorted_[k]);
      schur(std::max(row, column) - free_, std::min(row, column) - free_) += matrix_.values[sorted_[k]];
    }
    return true;
  }

  /// As run(), with what was compressed taken out by groups; `whole` is the last unknowns' own complement.
  bool run_compressed(Eigen::MatrixXd& whole) {
    TS_ASSERT(border_entries_ == sorted_.size());
    for (const int root : roots_) {
      const Update update = eliminate(root);
      if (failed_) return false;
      const auto size = static_cast<std::ptrdiff_t>(update.rows.size());
      const double* value = update.values.get();
      for (std::ptrdiff_t j = 0; j < size; ++j) {
        for (std::ptrdiff_t i = j; i < size; ++i) {
          whole(update.rows[i] - whole_from_, update.rows[j] - whole_from_) += *value++;
        }
      }
    }
    return true;
  }
  HierarchicalMatrix compressed(Eigen::MatrixXd& whole_rows);

  void describe(FactorReport& report) const {
    for (const Group& group : groups_) {
      const double n = static_cast<double>(group.rows.size());
      const double k = group.positive + group.negative;
      report.factor_entries += static_cast<std::int64_t>(k * n - k * (k - 1.0) / 2.0);
      report.negative_pivots += group.negative;
    }
    for (const int root : roots_) {
      report.operations += groups_[root].work;
      report.memory_mb = std::max(report.memory_mb, sizeof(double) * peak(root) / 1e6);
    }
  }

 private:
  /// Places in the order of elimination; within a group those of a positive diagonal come first.
  void place_unknowns(const EliminationTree& tree) {
    std::vector<double> diagonal(matrix_.size, 0.0);
    for (std::size_t k = 0; k < matrix_.rows.size(); ++k) {
      if (matrix_.rows[k] == matrix_.columns[k]) diagonal[matrix_.rows[k]] += matrix_.values[k];
    }
    TS_ASSERT(static_cast<int>(tree.order.size()) == free_);
    place_.assign(matrix_.size, -1);
    group_of_.resize(free_);
    int next = 0;
    for (std::size_t g = 0; g < groups_.size(); ++g) {
      Group& group = groups_[g];
      group.first = next;
      const int end = tree.end[g];
      const int begin = next;
      for (const bool positive : {true, false}) {
        for (int k = begin; k < end; ++k) {
          const int unknown = tree.order[k];
          if ((diagonal[unknown] > 0.0) != positive) continue;
          TS_ASSERT(unknown < free_ && place_[unknown] < 0);
          group_of_[next] = static_cast<int>(g);
          place_[unknown] = next++;
          ++(positive ? group.positive : group.negative);
        }
      }
    }
    TS_ASSERT(next == free_);
    for (int border = free_; border < matrix_.size; ++border) place_[border] = border;
  }

  std::pair<int, int> places_of(std::size_t entry) const {
    return {place_[matrix_.rows[entry]], place_[matrix_.columns[entry]]};
  }

  /// Each entry belongs to the group that eliminates the earlier of its two unknowns; those of the border to none.
  void sort_entries(const EliminationTree& tree) {
    const std::size_t none = tree.parent.size();
    std::vector<std::size_t> count(none + 2, 0);
    const auto owner = [&](std::size_t entry) {
      const auto [row, column] = places_of(entry);
      const int earlier = std::min(row, column);
      return earlier < free_ ? static_cast<std::size_t>(group_of_[earlier]) : none;
    };
    for (std::size_t k = 0; k < matrix_.rows.size(); ++k) ++count[owner(k) + 1];
    for (std::size_t g = 0; g <= none; ++g) count[g + 1] += count[g];
    for (std::size_t g = 0; g < none; ++g) {
      groups_[g].entries = count[g];
      groups_[g].entries_end = count[g + 1];
    }
    border_entries_ = count[none];
    sorted_.resize(matrix_.rows.size());
    for (std::size_t k = 0; k < sorted_.size(); ++k) sorted_[count[owner(k)]++] = k;
  }

  /// Children come before parents.
  void find_rows(Group& group) {
    const int pivots = group.positive + group.negative;
    const int end = group.first + pivots;
    std::vector<int> later;
    for (std::size_t k = group.entries; k < group.entries_end; ++k) {
      const auto [row, column] = places_of(sorted_[k]);
      if (std::max(row, column) >= end) later.push_back(std::max(row, column));
    }
    for (const int child : group.children) {
      const Group& below = groups_[child];
      for (std::size_t i = static_cast<std::size_t>(below.positive + below.negative); i < below.rows.size(); ++i) {
        if (below.rows[i] >= end) later.push_back(below.rows[i]);
      }
      group.work += below.work;
    }
    std::sort(later.begin(), later.end());
    later.erase(std::unique(later.begin(), later.end()), later.end());
    group.rows.resize(pivots);
    for (int k = 0; k < pivots; ++k) group.rows[k] = group.first + k;
    group.rows.insert(group.rows.end(), later.begin(), later.end());
    const double n = static_cast<double>(group.rows.size());
    const double rest = n - pivots;
    group.work += (n * n * n - rest * rest * rest) / 3.0;
  }

  Update eliminate(int number) {
    Group& group = groups_[number];
    std::vector<Update> updates(group.children.size());
    const auto one_child = [&](std::size_t k) { updates[k] = eliminate(group.children[k]); };
    // A branch of little work isn't worth a task.
    if (group.work > 1e8 && updates.size() > 1) {
      tbb::parallel_for(std::size_t{0}, updates.size(), one_child);
    } else {
      for (std::size_t k = 0; k < updates.size(); ++k) one_child(k);
    }
    if (failed_) return {};
    if (compresses_) find_compressed_rows(group, updates);

    const auto size = static_cast<std::ptrdiff_t>(group.rows.size());
    group.size = size;
    Numbers memory = pool_.take(static_cast<std::size_t>(size * size));
    double* const front = memory.get();
    each(size, [&](std::ptrdiff_t j) { std::fill(front + j * size + j, front + (j + 1) * size, 0.0); });
    const auto place_in_front = [&](int place) {
      const auto pivots = static_cast<std::ptrdiff_t>(group.positive + group.negative);
      if (place < group.first + pivots) return static_cast<std::ptrdiff_t>(place - group.first);
      return std::lower_bound(group.rows.begin() + pivots, group.rows.end(), place) - group.rows.begin();
    };
    for (std::size_t k = group.entries; k < group.entries_end; ++k) {
      const auto [row, column] = places_of(sorted_[k]);
      const std::ptrdiff_t i = place_in_front(std::max(row, column));
      const std::ptrdiff_t j = place_in_front(std::min(row, column));
      front[i + j * size] += matrix_.values[sorted_[k]];
    }
    for (Update& update : updates) {
      add(update, place_in_front, front, size);
      pool_.give_back(std::move(update.values));
    }
    if (!eliminate_front(front, static_cast<int>(size), group.positive, group.negative)) failed_ = true;
    Update result = left_over(group, front, size);
    pool_.give_back(std::move(memory));
    if (compresses_ && !failed_) compress(number, result);
    group.left = std::ssize(result.rows);
    return result;
  }

  /// Its rows once it is known what its children's were compressed to.
  void find_compressed_rows(Group& group, const std::vector<Update>& updates) const {
    const int pivots = group.positive + group.negative;
    std::vector<int> later;
    for (std::size_t k = group.entries; k < group.entries_end; ++k) {
      const auto [row, column] = places_of(sorted_[k]);
      if (std::max(row, column) >= group.first + pivots) later.push_back(std::max(row, column));
    }
    for (const Update& update : updates) {
      for (const int row : update.rows) {
        if (row >= group.first + pivots) later.push_back(row);
      }
    }
    std::sort(later.begin(), later.end());
    later.erase(std::unique(later.begin(), later.end()), later.end());
    group.rows.resize(static_cast<std::size_t>(pivots));
    group.rows.insert(group.rows.end(), later.begin(), later.end());
  }

  /// Takes the border's own complement out of what a group leaves, and leaves few combinations of the border's rows.
  void compress(int number, Update& update) {
    std::vector<std::ptrdiff_t> kept;     // later unknowns, then whole rows of the border
    std::vector<std::ptrdiff_t> members;  // rows to be compressed
    std::ptrdiff_t later = 0;
    for (std::ptrdiff_t i = 0; i < std::ssize(update.rows); ++i) {
      const int row = update.rows[i];
      later += row < free_;
      const bool stays = row < free_ || (row >= whole_from_ && row < matrix_.size);
      (stays ? kept : members).push_back(i);
    }
    const auto count = std::ssize(members);
    const auto keep = std::ssize(kept);
    if (count == 0 || (later > 0 && (count < kLeastCompressed || static_cast<double>(count) < kFewLater * static_cast<double>(later)))) return;
    const std::ptrdiff_t size = std::ssize(update.rows);
    const auto value = [&](std::ptrdiff_t i, std::ptrdiff_t j) {
      const auto [low, high] = std::minmax(i, j);
      return update.values.get()[low * size - low * (low - 1) / 2 + high - low];
    };
    Compressed found;
    RowSkeleton& few = found.skeleton;
    if (later > 0) {
      double largest = 0.0;
      for (const std::ptrdiff_t k : members) largest = std::max(largest, std::abs(value(k, k)));
      Eigen::MatrixXd rows(count, later);
      Eigen::VectorXd scale(later);
      for (std::ptrdiff_t j = 0; j < later; ++j) {
        scale[j] = std::abs(value(kept[j], kept[j]));
        for (std::ptrdiff_t i = 0; i < count; ++i) rows(i, j) = value(members[i], kept[j]);
      }
      scale = scale.cwiseMax(1e-6 * scale.maxCoeff()).cwiseSqrt();
      few = row_skeleton(rows, scale, kLeftOut * std::sqrt(largest));
      if (static_cast<double>(few.kept.size()) > kWorthCompressing * static_cast<double>(count)) return;
    }
    found.core.resize(count, count);
    for (std::ptrdiff_t j = 0; j < count; ++j) {
      for (std::ptrdiff_t i = 0; i < count; ++i) {
        found.core(i, j) = static_cast<float>(value(members[i], members[j]));
      }
    }
    found.whole.resize(keep - later, count);
    for (std::ptrdiff_t j = 0; j < count; ++j) {
      for (std::ptrdiff_t i = later; i < keep; ++i) found.whole(i - later, j) = value(kept[i], members[j]);
    }
    for (const std::ptrdiff_t k : members) found.members.push_back(update.rows[k]);
    const auto rank = std::ssize(few.kept);
    Update less;
    for (const std::ptrdiff_t k : kept) less.rows.push_back(update.rows[k]);
    for (std::ptrdiff_t k = 0; k < rank; ++k) less.rows.push_back(first_basis_[number] + static_cast<int>(k));
    less.values = pool_.take(static_cast<std::size_t>(packed(keep + rank)));
    double* to = less.values.get();
    for (std::ptrdiff_t j = 0; j < keep + rank; ++j) {
      for (std::ptrdiff_t i = j; i < keep; ++i) *to++ = value(kept[i], kept[j]);
      for (std::ptrdiff_t i = std::max(j, keep); i < keep + rank; ++i) *to++ = j < later ? value(members[few.kept[i - keep]], kept[j]) : 0.0;
    }
    compressed_[number] = std::move(found);
    pool_.give_back(std::move(update.values));
    update = std::move(less);
  }

  /// Adds a child's update to its parent's front.
  template <typename Place>
  void add(const Update& update, const Place& place, double* front, std::ptrdiff_t size) const {
    const auto count = static_cast<std::ptrdiff_t>(update.rows.size());
    std::vector<std::ptrdiff_t> to(update.rows.size());
    for (std::ptrdiff_t i = 0; i < count; ++i) to[i] = place(update.rows[i]);
    each(count, [&](std::ptrdiff_t j) {
      const double* value = update.values.get() + j * count - j * (j - 1) / 2;
      double* column = front + to[j] * size;
      for (std::ptrdiff_t i = j; i < count; ++i) column[to[i]] += *value++;
    });
  }

  Update left_over(const Group& group, const double* front, std::ptrdiff_t size) {
    const auto pivots = static_cast<std::ptrdiff_t>(group.positive + group.negative);
    const std::ptrdiff_t count = size - pivots;
    Update result;
    result.rows.assign(group.rows.begin() + pivots, group.rows.end());
    result.values = pool_.take(static_cast<std::size_t>(packed(count)));
    each(count, [&](std::ptrdiff_t j) {
      const double* column = front + (pivots + j) * size + pivots;
      std::copy(column + j, column + count, result.values.get() + j * count - j * (j - 1) / 2);
    });
    return result;
  }

  template <typename Work>
  static void each(std::ptrdiff_t count, const Work& work) {
    if (count < 300) {
      for (std::ptrdiff_t k = 0; k < count; ++k) work(k);
    } else {
      tbb::this_task_arena::isolate([&] { tbb::parallel_for(std::ptrdiff_t{0}, count, work); });
    }
  }

  static std::ptrdiff_t packed(std::ptrdiff_t size) { return size * (size + 1) / 2; }

  /// Doubles at the peak of a branch that is eliminated by itself, one front at a time.
  double peak(int number) const {
    const Group& group = groups_[number];
    double kept = 0.0;
    double most = 0.0;
    for (const int child : group.children) {
      most = std::max(most, kept + peak(child));
      const Group& below = groups_[child];
      kept += static_cast<double>(packed(below.left));
    }
    return std::max(most, kept + std::pow(static_cast<double>(group.size), 2));
  }

  const SymmetricEntries& matrix_;
  int free_;
  int whole_from_;
  bool compresses_;
  std::vector<Group> groups_;
  std::vector<int> roots_;
  std::vector<int> place_;     ///< of each unknown in the order of elimination
  std::vector<int> group_of_;  ///< of each place
  std::vector<std::size_t> sorted_;
  std::size_t border_entries_ = 0;  ///< from here on in `sorted_`
  std::vector<int> first_basis_;  ///< place of each group's first basis vector
  std::vector<std::optional<Compressed>> compressed_;
  Pool pool_;
  std::atomic<bool> failed_{false};
};

/// Rows of a front that wait for a parent that compresses are members of the next group above that does.
HierarchicalMatrix Elimination::compressed(Eigen::MatrixXd& whole_rows) {
  std::vector<HierarchicalMatrix::Node> nodes;
  std::vector<Eigen::MatrixXd> whole;
  std::vector<int> node_of(groups_.size(), -1);
  std::vector<float> numbers;
  const auto keep = [&](const Eigen::MatrixXf& block) {
    const std::size_t at = numbers.size();
    numbers.insert(numbers.end(), block.data(), block.data() + block.size());
    return at;
  };
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    if (!compressed_[g]) continue;
    Compressed& found = *compressed_[g];
    HierarchicalMatrix::Node node;
    const int number = static_cast<int>(nodes.size());
    node.members = static_cast<int>(found.members.size());
    node.rank = static_cast<int>(found.skeleton.kept.size());
    for (int k = 0; k < node.members; ++k) {
      const int place = found.members[k];
      if (place < matrix_.size) {
        node.unknowns.push_back(place - free_);
        continue;
      }
      const auto from = std::upper_bound(first_basis_.begin(), first_basis_.end(), place) - first_basis_.begin() - 1;
      if (place > first_basis_[from]) continue;
      nodes[node_of[from]].parent = number;
      nodes[node_of[from]].place = k;
    }
    node.core = keep(found.core);
    if (node.rank > 0) node.from = keep(found.skeleton.from.cast<float>());
    node.kept = std::move(found.skeleton.kept);
    node.others = std::move(found.skeleton.others);
    node_of[g] = number;
    nodes.push_back(std::move(node));
    whole.push_back(found.whole);
    compressed_[g].reset();
  }
  HierarchicalMatrix result(whole_from_ - free_, std::move(nodes), std::move(numbers));
  whole_rows = result.by_unknowns(whole);
  return result;
}

}  // namespace

std::optional<Eigen::MatrixXd> quasi_definite_schur(const SymmetricEntries& matrix, int last,
                                                    const EliminationTree& tree, FactorReport* report) {
  const auto start = std::chrono::steady_clock::now();
  if (openblas_get_num_threads() != 1) openblas_set_num_threads(1);
  Elimination elimination(matrix, last, tree);
  const auto middle = std::chrono::steady_clock::now();
  Eigen::MatrixXd schur = Eigen::MatrixXd::Zero(last, last);
  if (!elimination.run(schur) || !schur.allFinite()) return std::nullopt;
  schur.triangularView<Eigen::StrictlyUpper>() = schur.transpose();
  if (report != nullptr) {
    *report = {};
    elimination.describe(*report);
    report->analysis_seconds = std::chrono::duration<double>(middle - start).count();
    report->factor_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - middle).count();
  }
  return schur;
}

std::optional<CompressedSchur> compressed_schur(const SymmetricEntries& matrix, int last, int whole,
                                                const EliminationTree& tree, FactorReport* report) {
  const auto start = std::chrono::steady_clock::now();
  if (openblas_get_num_threads() != 1) openblas_set_num_threads(1);
  Elimination elimination(matrix, last, tree, whole);
  const auto middle = std::chrono::steady_clock::now();
  CompressedSchur result;
  result.whole = Eigen::MatrixXd::Zero(whole, last);
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(whole, whole);
  if (!elimination.run_compressed(own)) return std::nullopt;
  Eigen::MatrixXd rows;
  result.compressed = elimination.compressed(rows);
  result.whole.leftCols(last - whole) = rows;
  result.whole.rightCols(whole) = own.selfadjointView<Eigen::Lower>();
  if (report != nullptr) {
    *report = {};
    elimination.describe(*report);
    report->analysis_seconds = std::chrono::duration<double>(middle - start).count();
    report->factor_seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - middle).count();
  }
  return result;
}

}  // namespace touchstone::fem
