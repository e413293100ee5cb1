#pragma once
// A large matrix that several presses, and several processes, read at once.

#include <Eigen/Core>
#include <memory>
#include <utility>

namespace touchstone::fem {

/// A matrix, by columns, that is never changed once it is here: its numbers lie on the heap or in a mapped file, and
/// live as long as any copy of this. Copying it copies no numbers.
class SharedMatrix {
 public:
  /// The numbers where they lie, by columns.
  using View = Eigen::Map<const Eigen::MatrixXd>;

  /// Of size 0 x 0.
  SharedMatrix() = default;

  /// Takes the numbers over; without a copy if `matrix` is moved in.
  SharedMatrix(Eigen::MatrixXd matrix) {  // NOLINT: a matrix is one of these
    const auto owned = std::make_shared<const Eigen::MatrixXd>(std::move(matrix));
    data_ = {owned, owned->data()};
    rows_ = owned->rows();
    cols_ = owned->cols();
  }

  /// rows x cols numbers from `data` on, which live as long as the pointer's owner does.
  SharedMatrix(std::shared_ptr<const double> data, Eigen::Index rows, Eigen::Index cols)
      : data_(std::move(data)), rows_(rows), cols_(cols) {}

  Eigen::Index rows() const { return rows_; }
  Eigen::Index cols() const { return cols_; }
  Eigen::Index size() const { return rows_ * cols_; }

  /// To compute with; don't let it outlive this.
  View view() const { return View(data_.get(), rows_, cols_); }

 private:
  std::shared_ptr<const double> data_;
  Eigen::Index rows_ = 0;
  Eigen::Index cols_ = 0;
};

}  // namespace touchstone::fem
