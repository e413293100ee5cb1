#include "fem/elements/schur_solver.h"

#include <dmumps_c.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <numeric>

#include "core/error.h"
#include "core/seconds_since.h"

extern "C" {
void openblas_set_num_threads(int);
int openblas_get_num_threads(void);
char* openblas_get_corename(void);
}

namespace touchstone::fem {
namespace {

constexpr int kUseCommWorld = -987654;
constexpr int kInit = -1;
constexpr int kEnd = -2;
constexpr int kAnalyse = 1;
constexpr int kFactorise = 2;
constexpr int kSolve = 3;
constexpr int kGivenOrder = 1;  // of ICNTL(7)
/// How often the working space that MUMPS guessed may be raised.
constexpr int kMostRaises = 6;

/// OpenBLAS with one thread while this lives: sums in one order.
class OneBlasThread {
 public:
  OneBlasThread() : before_(openblas_get_num_threads()) { openblas_set_num_threads(1); }
  ~OneBlasThread() { openblas_set_num_threads(before_); }
  OneBlasThread(const OneBlasThread&) = delete;
  OneBlasThread& operator=(const OneBlasThread&) = delete;

 private:
  int before_;
};

/// One instance of MUMPS. MUMPS has global state, so only one lives at a time.
class Mumps {
 public:
  explicit Mumps(const SymmetricEntries& matrix) : lock_(gate()), rows_(matrix.rows), columns_(matrix.columns) {
    TS_ASSERT(matrix.size > 0 && rows_.size() == columns_.size() && rows_.size() == matrix.values.size());
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      ++rows_[k];  // MUMPS counts from one
      ++columns_[k];
    }
    data_.sym = 2;
    data_.par = 1;
    data_.comm_fortran = kUseCommWorld;
    run(kInit);
    alive_ = true;
    data_.n = matrix.size;
    data_.nnz = static_cast<MUMPS_INT8>(rows_.size());
    data_.irn = rows_.data();
    data_.jcn = columns_.data();
    data_.a = const_cast<double*>(matrix.values.data());  // only read
    for (int unit = 1; unit <= 3; ++unit) {
      control(unit) = -1;  // silent
    }
    control(4) = 0;
    control(14) = 30;  // percent of working space over the estimate, for delayed pivots
  }
  ~Mumps() {
    if (alive_) {
      data_.job = kEnd;
      dmumps_c(&data_);
    }
  }
  Mumps(const Mumps&) = delete;
  Mumps& operator=(const Mumps&) = delete;

  DMUMPS_STRUC_C& data() { return data_; }
  /// ICNTL of the users' guide, which counts from one.
  MUMPS_INT& control(int number) { return data_.icntl[number - 1]; }

  void analyse_and_factorise(FactorReport* report) {
    FactorReport found;
    auto start = std::chrono::steady_clock::now();
    run(kAnalyse);
    found.analysis_seconds = seconds_since(start);
    start = std::chrono::steady_clock::now();
    data_.job = kFactorise;
    dmumps_c(&data_);
    for (int raise = 0; raise < kMostRaises && (data_.infog[0] == -8 || data_.infog[0] == -9); ++raise) {
      control(14) *= 2;
      data_.job = kFactorise;
      dmumps_c(&data_);
    }
    stop_on_error();
    found.factor_seconds = seconds_since(start);
    const auto large = [](MUMPS_INT value) {  // the guide: negative means millions
      return value < 0 ? -static_cast<std::int64_t>(value) * 1000000 : static_cast<std::int64_t>(value);
    };
    found.factor_entries = large(data_.infog[28]);
    found.operations = data_.rinfog[2];
    found.memory_mb = static_cast<double>(data_.infog[21]);
    found.negative_pivots = data_.infog[11];
    found.delayed_pivots = data_.infog[12];
    if (report != nullptr) {
      *report = found;
    }
  }

  void run(int job) {
    data_.job = job;
    dmumps_c(&data_);
    stop_on_error();
  }

 private:
  static std::unique_lock<std::mutex> gate() {
    static std::mutex one_at_a_time;
    return std::unique_lock(one_at_a_time);
  }

  void stop_on_error() const {
    const int code = data_.infog[0];
    if (code >= 0) {
      return;
    }
    switch (code) {
      case -6:
      case -10:
        fail("the elastic system is singular: is each piece of the gel bonded?");
      case -5:
      case -7:
      case -13:
        fail("there isn't enough memory to factorise the elastic system (MUMPS error {}, {}); make the mesh coarser",
             code, data_.infog[1]);
      default:
        fail("MUMPS couldn't factorise the elastic system (error {}, {})", code, data_.infog[1]);
    }
  }

  std::unique_lock<std::mutex> lock_;
  OneBlasThread one_thread_;
  std::vector<int> rows_;
  std::vector<int> columns_;
  DMUMPS_STRUC_C data_{};
  bool alive_ = false;
};

void stop_unless_finite(const Eigen::MatrixXd& answer) {
  if (!answer.allFinite()) {
    fail("the elastic system has no finite answer: it is singular, or its numbers are out of range");
  }
}

/// Place of each unknown in the order of elimination, from one; those that aren't in `order` come last.
std::vector<int> places_of(std::span<const int> order, int size) {
  std::vector<int> places(size, 0);
  int next = 1;
  for (const int unknown : order) {
    TS_ASSERT(unknown >= 0 && unknown < size && places[unknown] == 0);
    places[unknown] = next++;
  }
  for (int& place : places) {
    if (place == 0) {
      place = next++;
    }
  }
  return places;
}

}  // namespace

struct BorderedFactor::Parts {
  Parts(const SymmetricEntries& matrix, int last, std::span<const int> order)
      : places(places_of(order, matrix.size)), kept(last), mumps(matrix) {
    std::iota(kept.begin(), kept.end(), matrix.size - last + 1);
  }
  std::vector<int> places;
  std::vector<int> kept;
  Mumps mumps;
};

BorderedFactor::BorderedFactor(const SymmetricEntries& matrix, int last, std::span<const int> order,
                               FactorReport* report, bool keep) {
  TS_ASSERT(last > 0 && last < matrix.size && static_cast<int>(order.size()) == matrix.size - last);
  parts_ = std::make_unique<Parts>(matrix, last, order);
  complement_ = Eigen::MatrixXd::Zero(last, last);
  Mumps& mumps = parts_->mumps;
  mumps.data().size_schur = last;
  mumps.data().listvar_schur = parts_->kept.data();
  mumps.data().schur = complement_.data();
  mumps.data().nprow = mumps.data().npcol = 1;
  mumps.data().mblock = mumps.data().nblock = 100;
  mumps.control(19) = 2;  // the lower triangle, by columns
  mumps.data().schur_lld = last;
  mumps.control(7) = kGivenOrder;
  mumps.control(31) = keep ? 0 : 1;  // else the factor isn't kept: it's two thirds of the memory
  mumps.data().perm_in = parts_->places.data();
  mumps.analyse_and_factorise(report);
  stop_unless_finite(complement_);
  complement_.triangularView<Eigen::StrictlyUpper>() = complement_.transpose();
}

BorderedFactor::~BorderedFactor() = default;

Eigen::VectorXd BorderedFactor::solve(const Eigen::VectorXd& right) {
  Mumps& mumps = parts_->mumps;
  const Eigen::Index inner = mumps.data().n - complement_.rows();
  TS_ASSERT(right.size() == inner);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(mumps.data().n);
  x.head(inner) = right;
  mumps.control(26) = 0;  // the system without its last unknowns
  mumps.data().nrhs = 1;
  mumps.data().lrhs = mumps.data().n;
  mumps.data().rhs = x.data();
  mumps.run(kSolve);
  Eigen::VectorXd solution = x.head(inner);
  stop_unless_finite(solution);
  return solution;
}

Eigen::MatrixXd schur_complement(const SymmetricEntries& matrix, int last, std::span<const int> order,
                                 FactorReport* report) {
  return BorderedFactor(matrix, last, order, report, false).take_complement();
}

Eigen::MatrixXd solve_symmetric(const SymmetricEntries& matrix, std::span<const int> order,
                                const Eigen::MatrixXd& right, FactorReport* report) {
  TS_ASSERT(right.rows() == matrix.size && static_cast<int>(order.size()) == matrix.size);
  std::vector<int> places = places_of(order, matrix.size);
  Mumps mumps(matrix);
  mumps.control(7) = kGivenOrder;
  mumps.data().perm_in = places.data();
  mumps.analyse_and_factorise(report);
  Eigen::MatrixXd solution(right.rows(), right.cols());
  for (Eigen::Index column = 0; column < right.cols(); ++column) {  // refinement is for one right-hand side at a time
    Eigen::VectorXd x = right.col(column);
    mumps.control(10) = -2;
    mumps.data().nrhs = 1;
    mumps.data().lrhs = matrix.size;
    mumps.data().rhs = x.data();
    mumps.run(kSolve);
    solution.col(column) = x;
  }
  stop_unless_finite(solution);
  return solution;
}

struct SymmetricFactor::Parts {
  Parts(const SymmetricEntries& matrix, std::span<const int> order)
      : values(matrix.values), places(places_of(order, matrix.size)), mumps(matrix) {
    mumps.data().a = values.data();
  }
  std::vector<double> values;  // the matrix itself may not live as long
  std::vector<int> places;
  Mumps mumps;
};

SymmetricFactor::SymmetricFactor(const SymmetricEntries& matrix, std::span<const int> order, FactorReport* report) {
  TS_ASSERT(static_cast<int>(order.size()) == matrix.size);
  parts_ = std::make_unique<Parts>(matrix, order);
  parts_->mumps.control(7) = kGivenOrder;
  parts_->mumps.data().perm_in = parts_->places.data();
  parts_->mumps.analyse_and_factorise(report);
}

SymmetricFactor::~SymmetricFactor() = default;

int SymmetricFactor::size() const {
  return static_cast<int>(parts_->places.size());
}

Eigen::VectorXd SymmetricFactor::solve(Eigen::VectorXd right) const {
  TS_ASSERT(right.size() == size());
  Mumps& mumps = parts_->mumps;
  mumps.data().nrhs = 1;
  mumps.data().lrhs = size();
  mumps.data().rhs = right.data();
  mumps.run(kSolve);
  stop_unless_finite(right);
  return right;
}

std::string blas_core_name() {
  return openblas_get_corename();
}

}  // namespace touchstone::fem
