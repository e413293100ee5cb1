#pragma once
// Between Python's arrays and ours. All functions need the GIL.

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/frame.h"
#include "core/progress.h"
#include "core/transform.h"

namespace touchstone::python {

namespace py = pybind11;

/// Releases the GIL for `work` and gives what that returns.
template <typename Work>
auto unlocked(const Work& work) {
  const py::gil_scoped_release release;
  return work();
}

/// A picture on an array's own memory: valid as long as `array` is.
struct Picture {
  py::array array;
  cv::Mat mat;
};

/// An array of 8 or 16 bit, height x width (grey) or height x width x 3 (BGR). Copied only where its rows aren't
/// packed.
/// @throws Error naming `what`
Picture picture_from(const py::handle& value, const char* what);
std::vector<Picture> pictures_from(const py::handle& value, const char* what);

/// The picture's own memory as an array, which keeps it alive. An empty picture is None.
py::object array_of(const cv::Mat& picture);
/// The same of a mask, as bool. @pre its values are 0 and 1
py::object bool_array_of(const cv::Mat& mask);

/// The same array, which Python can't write into: what others read, too.
inline py::array read_only(py::array array) {
  array.attr("setflags")(py::arg("write") = false);
  return array;
}

/// Rows of numbers within `owner`, without a copy. Eigen keeps columns together.
template <typename Matrix>
py::array array_within(const Matrix& matrix, const py::handle& owner) {
  using Scalar = typename Matrix::Scalar;
  constexpr auto kItem = static_cast<py::ssize_t>(sizeof(Scalar));
  const auto rows = static_cast<py::ssize_t>(matrix.rows());
  const auto columns = static_cast<py::ssize_t>(matrix.cols());
  return py::array_t<Scalar>({rows, columns}, {kItem, kItem * static_cast<py::ssize_t>(matrix.outerStride())},
                             matrix.data(), owner);
}

/// A small vector or matrix, copied; a column is one-dimensional.
template <typename Matrix>
py::array small_array(const Matrix& matrix) {
  const auto rows = static_cast<py::ssize_t>(matrix.rows());
  const auto columns = static_cast<py::ssize_t>(matrix.cols());
  py::array_t<double> out(columns == 1 ? std::vector<py::ssize_t>{rows} : std::vector<py::ssize_t>{rows, columns});
  double* to = out.mutable_data();
  for (py::ssize_t i = 0; i < rows; ++i) {
    for (py::ssize_t j = 0; j < columns; ++j) *to++ = matrix(i, j);
  }
  return out;
}
/// 3 x 4: rotation, then translation in mm.
py::array pose_array(const RigidTransform& pose);
/// n x 2 or n x 3.
py::array points_array(const std::vector<Eigen::Vector2d>& points);
py::array points_array(const std::vector<Eigen::Vector3d>& points);

/// A copy as records of `t_us`, `x`, `y` and `on`.
py::object events_array(const std::vector<Event>& events);

/// Numbers in row-major order, `columns` of them a row. @throws Error naming `what` and its shape
std::vector<double> numbers_from(const py::handle& value, py::ssize_t columns, const char* what);
/// Numbers in one row, as many as there are. @throws Error naming `what` and its shape
std::vector<double> row_from(const py::handle& value, const char* what);
Eigen::Vector2d vector2_from(const py::handle& value, const char* what);
Eigen::Vector3d vector3_from(const py::handle& value, const char* what);
std::vector<Eigen::Vector2d> points2_from(const py::handle& value, const char* what);
std::vector<Eigen::Vector3d> points3_from(const py::handle& value, const char* what);
/// 3 x 4 or 4 x 4. Whether it's a rotation is for who moves by it to check.
RigidTransform pose_from(const py::handle& value, const char* what);

/// What Python's own conversions refuse by an error that doesn't say which argument it is about.
/// @throws Error naming `what`
double number_from(const py::handle& value, const std::string& what);
/// An int of Python within these bounds, for whole_number_from. @throws Error naming `what`
py::int_ whole_number_within(const py::handle& value, const std::string& what, const py::int_& low,
                             const py::int_& high);
/// Neither 2.0 nor a text of digits is one. @throws Error naming `what`
template <typename T = std::int64_t>
T whole_number_from(const py::handle& value, const std::string& what, T low = std::numeric_limits<T>::min(),
                    T high = std::numeric_limits<T>::max()) {
  return whole_number_within(value, what, py::int_(low), py::int_(high)).cast<T>();
}
py::sequence sequence_from(const py::handle& value, const char* what);
/// Calls `use` for each item of a list, a tuple, an array or whatever else can be gone through.
void for_each_item(const py::handle& value, const char* what, const std::function<void(const py::object&)>& use);
/// The bytes of a path: of a str (whatever bytes Python has put into it), of bytes or of what has `__fspath__`.
/// @throws Error naming `what` for anything else, and for a zero byte, at which another file would be taken
std::string path_from(const py::handle& value, const char* what);
/// The same of a path that must not be empty.
std::string needed_path(const py::handle& value, const char* what);
/// What chooses the noise. @throws Error
inline std::uint64_t seed_from(const py::handle& value, const char* what) {
  return whole_number_from<std::uint64_t>(value, what);
}
inline int frame_from(const py::handle& value) {
  return whole_number_from<int>(value, "frame", 0);
}

/// A text of Python as UTF-8. @throws Error naming `what` for anything else, and for halves of letters
std::string text_from(const py::handle& value, const char* what);
/// A text of ours, which may have a file's bytes in it: those that aren't UTF-8 are written as their codes.
py::str text_of(const std::string& text);

/// Hands progress to a Python function (None: nobody) and looks for Ctrl-C. Works from any thread.
Progress progress_to(const py::object& listener);

}  // namespace touchstone::python
