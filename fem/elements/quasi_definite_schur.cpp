#include "fem/elements/quasi_definite_schur.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/error.h"
#include "fem/elements/elimination_groups.h"
#include "fem/elements/front.h"
#include "fem/elements/front_factors.h"
#include "fem/elements/number_pool.h"
#include "fem/elements/row_skeleton.h"

extern "C" {
void openblas_set_num_threads(int);
int openblas_get_num_threads(void);
}

namespace touchstone::fem {
namespace {

/// What a group of unknowns leaves to its parent: the rows of its front that weren't eliminated, and the lower half of
/// their Schur complement, column after column.
struct Update {
  std::vector<int> rows;
  Numbers values;
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

/// In double precision, or in single precision with the factors kept.
template <typename Real>
class Elimination {
 public:
  /// `whole`: of the border's last unknowns, whose rows stay as they are while the others' are compressed.
  /// `kept`: takes each front's factor; null in double precision.
  Elimination(const SymmetricEntries& matrix, int last, const EliminationTree& tree, std::optional<int> whole = {},
              FrontFactors* kept = nullptr)
      : matrix_(matrix),
        free_(matrix.size - last),
        kept_(kept),
        whole_from_(matrix.size - whole.value_or(0)),
        compresses_(whole.has_value()),
        plan_(matrix, last, tree),
        groups_(plan_.groups()) {
    if (kept_ != nullptr) kept_->set_up(plan_, free_);
    if (!compresses_) return;
    compressed_.resize(groups_.size());
    // Basis vectors have places behind all unknowns.
    int next = matrix.size;
    for (const EliminationGroup& group : groups_) {
      first_basis_.push_back(next);
      next += static_cast<int>(group.rows.end() - std::lower_bound(group.rows.begin(), group.rows.end(), free_));
    }
  }

  /// The Schur complement's lower half; false if a pivot failed.
  bool run(Eigen::MatrixXd& schur) {
    for (const int root : plan_.roots()) {
      const Update update = eliminate(root);
      if (failed_) return false;
      const auto size = static_cast<std::ptrdiff_t>(update.rows.size());
      const Real* value = update.values.as<Real>();
      for (std::ptrdiff_t j = 0; j < size; ++j) {
        for (std::ptrdiff_t i = j; i < size; ++i) schur(update.rows[i] - free_, update.rows[j] - free_) += *value++;
      }
    }
    for (const std::size_t entry : plan_.border_entries()) {
      const auto [row, column] = plan_.places_of(entry);
      schur(std::max(row, column) - free_, std::min(row, column) - free_) += matrix_.values[entry];
    }
    return true;
  }

  /// As run(), with what was compressed taken out by groups; `whole` is the last unknowns' own complement.
  bool run_compressed(Eigen::MatrixXd& whole) {
    TS_ASSERT(plan_.border_entries().empty());
    for (const int root : plan_.roots()) {
      const Update update = eliminate(root);
      if (failed_) return false;
      const auto size = static_cast<std::ptrdiff_t>(update.rows.size());
      const Real* value = update.values.as<Real>();
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
    for (const EliminationGroup& group : groups_) {
      const double n = static_cast<double>(group.rows.size());
      const double k = group.positive + group.negative;
      report.factor_entries += static_cast<std::int64_t>(k * n - k * (k - 1.0) / 2.0);
      report.negative_pivots += group.negative;
    }
    for (const int root : plan_.roots()) {
      report.operations += groups_[root].work;
      report.memory_mb = std::max(report.memory_mb, sizeof(Real) * peak(root) / 1e6);
    }
  }

 private:
  Update eliminate(int number) {
    EliminationGroup& group = groups_[number];
    std::vector<Update> updates(group.children.size());
    const auto one_child = [&](std::size_t k) { updates[k] = eliminate(group.children[k]); };
    // A branch of little work isn't worth a task.
    if (group.work > 1e8 && updates.size() > 1) {
      tbb::parallel_for(std::size_t{0}, updates.size(), one_child);
    } else {
      for (std::size_t k = 0; k < updates.size(); ++k) one_child(k);
    }
    if (failed_) return {};
    if (compresses_) {  // it is known only now what its children's rows were compressed to
      std::vector<int> later;
      for (const Update& update : updates) later.insert(later.end(), update.rows.begin(), update.rows.end());
      plan_.set_rows(group, std::move(later));
    }

    const auto size = static_cast<std::ptrdiff_t>(group.rows.size());
    group.size = size;
    Numbers memory = take(size * size);
    Real* const front = memory.as<Real>();
    each(size, [&](std::ptrdiff_t j) { std::fill(front + j * size + j, front + (j + 1) * size, Real(0)); });
    const auto place_in_front = [&](int place) {
      const auto pivots = static_cast<std::ptrdiff_t>(group.positive + group.negative);
      if (place < group.first + pivots) return static_cast<std::ptrdiff_t>(place - group.first);
      return std::lower_bound(group.rows.begin() + pivots, group.rows.end(), place) - group.rows.begin();
    };
    for (const std::size_t entry : plan_.entries_of(group)) {
      const auto [row, column] = plan_.places_of(entry);
      const std::ptrdiff_t i = place_in_front(std::max(row, column));
      const std::ptrdiff_t j = place_in_front(std::min(row, column));
      front[i + j * size] += static_cast<Real>(matrix_.values[entry]);
    }
    for (Update& update : updates) {
      add(update, place_in_front, front, size);
      pool_.give_back(std::move(update.values));
    }
    if (!eliminate_own(number, front)) failed_ = true;
    Update result = left_over(group, front, size);
    pool_.give_back(std::move(memory));
    if (compresses_ && !failed_) compress(number, result);
    group.left = std::ssize(result.rows);
    return result;
  }

  /// Eliminates a group's own unknowns from its front. Where factors are kept with pivoting if a sign is wrong.
  bool eliminate_own(int number, Real* front) {
    const EliminationGroup& group = groups_[number];
    const auto size = static_cast<int>(group.size);
    if constexpr (std::is_same_v<Real, double>) {
      return eliminate_front(front, size, group.positive, group.negative);
    } else {
      const int pivots = group.positive + group.negative;
      const std::ptrdiff_t columns = group.size * pivots;
      Numbers before = take(columns);
      std::copy_n(front, columns, before.as<Real>());
      const bool definite = eliminate_front(front, size, group.positive, group.negative);
      if (!definite) std::copy_n(before.as<Real>(), columns, front);
      pool_.give_back(std::move(before));
      if (!definite && !eliminate_indefinite_front(front, size, pivots)) return false;
      kept_->keep(number, front, !definite);
      return true;
    }
  }

  /// At least `count` of its numbers.
  Numbers take(std::ptrdiff_t count) {
    return pool_.take((static_cast<std::size_t>(count) * sizeof(Real) + sizeof(double) - 1) / sizeof(double));
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
    if (count == 0 || (later > 0 && (count < kLeastCompressed ||
                                     static_cast<double>(count) < kFewLater * static_cast<double>(later))))
      return;
    const std::ptrdiff_t size = std::ssize(update.rows);
    const auto value = [&](std::ptrdiff_t i, std::ptrdiff_t j) {
      const auto [low, high] = std::minmax(i, j);
      return update.values.as<Real>()[low * size - low * (low - 1) / 2 + high - low];
    };
    Compressed found;
    RowSkeleton& few = found.skeleton;
    if (later > 0) {
      double largest = 0.0;
      for (const std::ptrdiff_t k : members) largest = std::max(largest, static_cast<double>(std::abs(value(k, k))));
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
    // Not all of them meet this front.
    found.whole = Eigen::MatrixXd::Zero(matrix_.size - whole_from_, count);
    for (std::ptrdiff_t i = later; i < keep; ++i) {
      const int row = update.rows[kept[i]] - whole_from_;
      for (std::ptrdiff_t j = 0; j < count; ++j) found.whole(row, j) = value(kept[i], members[j]);
    }
    for (const std::ptrdiff_t k : members) found.members.push_back(update.rows[k]);
    const auto rank = std::ssize(few.kept);
    Update less;
    for (const std::ptrdiff_t k : kept) less.rows.push_back(update.rows[k]);
    for (std::ptrdiff_t k = 0; k < rank; ++k) less.rows.push_back(first_basis_[number] + static_cast<int>(k));
    less.values = take(packed(keep + rank));
    Real* to = less.values.as<Real>();
    for (std::ptrdiff_t j = 0; j < keep + rank; ++j) {
      for (std::ptrdiff_t i = j; i < keep; ++i) *to++ = value(kept[i], kept[j]);
      for (std::ptrdiff_t i = std::max(j, keep); i < keep + rank; ++i)
        *to++ = j < later ? value(members[few.kept[i - keep]], kept[j]) : Real(0);
    }
    compressed_[number] = std::move(found);
    pool_.give_back(std::move(update.values));
    update = std::move(less);
  }

  /// Adds a child's update to its parent's front.
  template <typename Place>
  void add(const Update& update, const Place& place, Real* front, std::ptrdiff_t size) const {
    const auto count = static_cast<std::ptrdiff_t>(update.rows.size());
    std::vector<std::ptrdiff_t> to(update.rows.size());
    for (std::ptrdiff_t i = 0; i < count; ++i) to[i] = place(update.rows[i]);
    each(count, [&](std::ptrdiff_t j) {
      const Real* value = update.values.as<Real>() + j * count - j * (j - 1) / 2;
      Real* column = front + to[j] * size;
      for (std::ptrdiff_t i = j; i < count; ++i) column[to[i]] += *value++;
    });
  }

  Update left_over(const EliminationGroup& group, const Real* front, std::ptrdiff_t size) {
    const auto pivots = static_cast<std::ptrdiff_t>(group.positive + group.negative);
    const std::ptrdiff_t count = size - pivots;
    Update result;
    result.rows.assign(group.rows.begin() + pivots, group.rows.end());
    result.values = take(packed(count));
    each(count, [&](std::ptrdiff_t j) {
      const Real* column = front + (pivots + j) * size + pivots;
      std::copy(column + j, column + count, result.values.as<Real>() + j * count - j * (j - 1) / 2);
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
    const EliminationGroup& group = groups_[number];
    double kept = 0.0;
    double most = 0.0;
    for (const int child : group.children) {
      most = std::max(most, kept + peak(child));
      const EliminationGroup& below = groups_[child];
      kept += static_cast<double>(packed(below.left));
    }
    return std::max(most, kept + std::pow(static_cast<double>(group.size), 2));
  }

  const SymmetricEntries& matrix_;
  int free_;
  FrontFactors* kept_;
  int whole_from_;
  bool compresses_;
  EliminationGroups plan_;
  std::vector<EliminationGroup>& groups_;
  std::vector<int> first_basis_;  ///< place of each group's first basis vector
  std::vector<std::optional<Compressed>> compressed_;
  NumberPool pool_;
  std::atomic<bool> failed_{false};
};

/// Rows of a front that wait for a parent that compresses are members of the next group above that does.
template <typename Real>
HierarchicalMatrix Elimination<Real>::compressed(Eigen::MatrixXd& whole_rows) {
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

template <typename Real>
std::optional<Eigen::MatrixXd> schur_of(const SymmetricEntries& matrix, int last, const EliminationTree& tree,
                                        FrontFactors* kept, FactorReport* report) {
  const auto start = std::chrono::steady_clock::now();
  if (openblas_get_num_threads() != 1) openblas_set_num_threads(1);
  Elimination<Real> elimination(matrix, last, tree, {}, kept);
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

}  // namespace

std::optional<Eigen::MatrixXd> quasi_definite_schur(const SymmetricEntries& matrix, int last,
                                                    const EliminationTree& tree, FactorReport* report) {
  return schur_of<double>(matrix, last, tree, nullptr, report);
}

FrontalFactor::FrontalFactor() = default;
FrontalFactor::FrontalFactor(FrontalFactor&&) noexcept = default;
FrontalFactor& FrontalFactor::operator=(FrontalFactor&&) noexcept = default;
FrontalFactor::~FrontalFactor() = default;

std::optional<FrontalFactor> FrontalFactor::make(const SymmetricEntries& matrix, int last, const EliminationTree& tree,
                                                 FactorReport* report) {
  auto fronts = std::make_unique<FrontFactors>();
  std::optional<Eigen::MatrixXd> complement = schur_of<float>(matrix, last, tree, fronts.get(), report);
  if (!complement) return std::nullopt;
  FrontalFactor result;
  result.fronts_ = std::move(fronts);
  result.complement_ = std::move(*complement);
  return result;
}

Eigen::MatrixXd FrontalFactor::solve(const Eigen::MatrixXd& right) const {
  return fronts_->solve(right);
}

std::optional<CompressedSchur> compressed_schur(const SymmetricEntries& matrix, int last, int whole,
                                                const EliminationTree& tree, FactorReport* report) {
  const auto start = std::chrono::steady_clock::now();
  if (openblas_get_num_threads() != 1) openblas_set_num_threads(1);
  Elimination<double> elimination(matrix, last, tree, whole);
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
