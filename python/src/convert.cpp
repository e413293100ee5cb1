#include "python/src/convert.h"

#include <cmath>
#include <new>
#include <string>

#include "core/error.h"
#include "core/short_text.h"

namespace touchstone::python {
namespace {

std::string shape_text(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  return text + ")";
}

std::string type_text(const py::handle& value) {
  return py::str(py::type::of(value));
}

/// A value as a message may show it. Its repr may fail: of an int with thousands of digits, or of a user's own class.
std::string shown(const py::handle& value) {
  const auto text = py::reinterpret_steal<py::object>(PyObject_ASCII(value.ptr()));
  if (!text) {
    PyErr_Clear();
    return "one that can't be shown";
  }
  return short_text(text.cast<std::string>());
}

// OpenCV takes pictures of up to so many pixels a side; more of them in all are a mistake rather than a camera.
constexpr py::ssize_t kLongestSide = py::ssize_t{1} << 20;
constexpr py::ssize_t kMostPixels = py::ssize_t{1} << 28;
constexpr py::ssize_t kMostNumbers = py::ssize_t{1} << 28;

py::array_t<double, py::array::c_style | py::array::forcecast> doubles_from(const py::handle& value, const char* what) {
  if (py::isinstance<py::array>(value)) {
    // One that repeats a number may be larger than memory.
    const auto given = py::reinterpret_borrow<py::array>(value);
    if (given.size() > kMostNumbers) {
      fail("{}: an array of shape {} is too large; allowed are {} numbers", what, shape_text(given), kMostNumbers);
    }
  }
  auto array = py::array_t<double, py::array::c_style | py::array::forcecast>::ensure(value);
  if (!array) {
    PyErr_Clear();
    fail("{}: an array of numbers is needed, this is a {}", what, type_text(value));
  }
  for (py::ssize_t i = 0; i < array.size(); ++i) {
    if (!std::isfinite(array.data()[i])) fail("{}: number {} of it is {}; it must be finite", what, i, array.data()[i]);
  }
  return array;
}

/// Keeps what the listener is for as long as any thread may call it, and lets go of it under the GIL.
std::shared_ptr<py::object> shared_under_gil(const py::object& object) {
  return {new py::object(object), [](py::object* held) {
            const py::gil_scoped_acquire acquire;
            delete held;
          }};
}

template <int N>
std::vector<Eigen::Matrix<double, N, 1>> points_from(const py::handle& value, const char* what) {
  const std::vector<double> numbers = numbers_from(value, N, what);
  std::vector<Eigen::Matrix<double, N, 1>> points;
  for (std::size_t i = 0; i < numbers.size(); i += N) {
    points.emplace_back(Eigen::Map<const Eigen::Matrix<double, N, 1>>(&numbers[i]));
  }
  return points;
}

template <int N>
Eigen::Matrix<double, N, 1> vector_from(const py::handle& value, const char* what) {
  const auto array = doubles_from(value, what);
  if (array.ndim() != 1 || array.shape(0) != N) {
    fail("{}: {} numbers are needed, this has shape {}", what, N, shape_text(array));
  }
  return Eigen::Map<const Eigen::Matrix<double, N, 1>>(array.data());
}

template <typename Point>
py::array points_in_rows(const std::vector<Point>& points) {
  const py::ssize_t columns = Point::RowsAtCompileTime;
  py::array_t<double> out({static_cast<py::ssize_t>(points.size()), columns});
  double* to = out.mutable_data();
  for (const Point& point : points) {
    for (py::ssize_t j = 0; j < columns; ++j) *to++ = point[j];
  }
  return out;
}

py::object array_on(const cv::Mat& picture, const py::dtype& type) {
  if (picture.empty()) return py::none();
  auto* kept = new cv::Mat(picture);
  const py::capsule owner(kept, [](void* mat) { delete static_cast<cv::Mat*>(mat); });
  const auto item = static_cast<py::ssize_t>(picture.elemSize1());
  std::vector<py::ssize_t> shape{picture.rows, picture.cols};
  std::vector<py::ssize_t> strides{static_cast<py::ssize_t>(picture.step[0]),
                                   static_cast<py::ssize_t>(picture.elemSize())};
  if (picture.channels() > 1) {
    shape.push_back(picture.channels());
    strides.push_back(item);
  }
  return py::array(type, shape, strides, kept->data, owner);
}

}  // namespace

Picture picture_from(const py::handle& value, const char* what) {
  if (!py::isinstance<py::array>(value)) {
    fail("{}: a NumPy array is needed, this is a {}", what, type_text(value));
  }
  py::array array = py::reinterpret_borrow<py::array>(value);
  const bool colour = array.ndim() == 3 && array.shape(2) == 3;
  const char kind = array.dtype().kind();
  const auto item = array.itemsize();
  if ((array.ndim() != 2 && !colour) || kind != 'u' || (item != 1 && item != 2) || array.size() == 0) {
    fail(
        "{}: a picture is an array of uint8 or uint16 of shape (height, width) or (height, width, 3) in BGR order; "
        "this "
        "is {} of shape {}",
        what, std::string(py::str(array.dtype())), shape_text(array));
  }
  // Of one that repeats its pixels there is no more memory than they take: copied, it would be its full size.
  if (array.shape(0) > kLongestSide || array.shape(1) > kLongestSide || array.shape(0) * array.shape(1) > kMostPixels) {
    fail("{}: a picture of shape {} is too large; allowed are {} pixels a side and {} in all", what, shape_text(array),
         kLongestSide, kMostPixels);
  }
  const py::ssize_t channels = colour ? 3 : 1;
  const bool packed = array.strides(1) == item * channels && (!colour || array.strides(2) == item) &&
                      array.strides(0) >= array.shape(1) * item * channels;
  if (!packed) array = py::array::ensure(array, py::array::c_style);
  if (!array) throw std::bad_alloc();
  if (!array.dtype().equal(array.dtype().attr("newbyteorder")("="))) {
    fail("{}: its numbers are in a foreign byte order", what);
  }
  const int type = CV_MAKETYPE(item == 1 ? CV_8U : CV_16U, static_cast<int>(channels));
  // Estimators only read.
  cv::Mat mat(static_cast<int>(array.shape(0)), static_cast<int>(array.shape(1)), type, const_cast<void*>(array.data()),
              static_cast<std::size_t>(array.strides(0)));
  return {std::move(array), std::move(mat)};
}

std::vector<Picture> pictures_from(const py::handle& value, const char* what) {
  std::vector<Picture> pictures;
  for_each_item(value, what, [&](const py::object& one) { pictures.push_back(picture_from(one, what)); });
  if (pictures.empty()) fail("{}: no picture is given", what);
  return pictures;
}

py::object array_of(const cv::Mat& picture) {
  switch (picture.depth()) {
    case CV_8U:
      return array_on(picture, py::dtype::of<std::uint8_t>());
    case CV_16U:
      return array_on(picture, py::dtype::of<std::uint16_t>());
    case CV_32F:
      return array_on(picture, py::dtype::of<float>());
    default:
      TS_ASSERT(picture.depth() == CV_64F);
      return array_on(picture, py::dtype::of<double>());
  }
}

py::object bool_array_of(const cv::Mat& mask) {
  TS_ASSERT(mask.empty() || mask.type() == CV_8UC1);
  return array_on(mask, py::dtype::of<bool>());
}

py::array pose_array(const RigidTransform& pose) {
  Eigen::Matrix<double, 3, 4> rows;
  rows << pose.rotation, pose.translation;
  return small_array(rows);
}

py::object events_array(const std::vector<Event>& events) {
  const auto count = static_cast<py::ssize_t>(events.size());
  py::array_t<std::int64_t> t(count);
  py::array_t<std::uint16_t> x(count), y(count);
  py::array_t<bool> on(count);
  for (py::ssize_t k = 0; k < count; ++k) {
    const Event& event = events[static_cast<std::size_t>(k)];
    t.mutable_at(k) = event.t_us;
    x.mutable_at(k) = event.x;
    y.mutable_at(k) = event.y;
    on.mutable_at(k) = event.on;
  }
  const py::module_ numpy = py::module_::import("numpy");
  py::list dtype;
  dtype.append(py::make_tuple("t_us", "i8"));
  dtype.append(py::make_tuple("x", "u2"));
  dtype.append(py::make_tuple("y", "u2"));
  dtype.append(py::make_tuple("on", "?"));
  py::object records = numpy.attr("empty")(count, numpy.attr("dtype")(dtype));
  records[py::str("t_us")] = t;
  records[py::str("x")] = x;
  records[py::str("y")] = y;
  records[py::str("on")] = on;
  return records;
}

py::array points_array(const std::vector<Eigen::Vector2d>& points) {
  return points_in_rows(points);
}

py::array points_array(const std::vector<Eigen::Vector3d>& points) {
  return points_in_rows(points);
}

std::vector<double> numbers_from(const py::handle& value, py::ssize_t columns, const char* what) {
  const auto array = doubles_from(value, what);
  if (array.ndim() != 2 || array.shape(1) != columns) {
    fail("{}: an array of shape (n, {}) is needed, this has {}", what, columns, shape_text(array));
  }
  return {array.data(), array.data() + array.size()};
}

std::vector<double> row_from(const py::handle& value, const char* what) {
  const auto array = doubles_from(value, what);
  if (array.ndim() != 1) fail("{}: an array of shape (n,) is needed, this has {}", what, shape_text(array));
  return {array.data(), array.data() + array.size()};
}

Eigen::Vector2d vector2_from(const py::handle& value, const char* what) {
  return vector_from<2>(value, what);
}

Eigen::Vector3d vector3_from(const py::handle& value, const char* what) {
  return vector_from<3>(value, what);
}

std::vector<Eigen::Vector2d> points2_from(const py::handle& value, const char* what) {
  return points_from<2>(value, what);
}

std::vector<Eigen::Vector3d> points3_from(const py::handle& value, const char* what) {
  return points_from<3>(value, what);
}

RigidTransform pose_from(const py::handle& value, const char* what) {
  const auto array = doubles_from(value, what);
  const bool square = array.ndim() == 2 && array.shape(0) == 4 && array.shape(1) == 4;
  if (!square && !(array.ndim() == 2 && array.shape(0) == 3 && array.shape(1) == 4)) {
    fail("{}: a pose is an array of shape (3, 4) or (4, 4), rotation and then translation in mm; this has {}", what,
         shape_text(array));
  }
  const double* row = array.data();
  RigidTransform pose;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.rotation(i, j) = row[4 * i + j];
    pose.translation[i] = row[4 * i + 3];
  }
  if (square && (row[12] != 0.0 || row[13] != 0.0 || row[14] != 0.0 || row[15] != 1.0)) {
    fail("{}: the last row of a pose of shape (4, 4) is 0 0 0 1; this has {} {} {} {}", what, row[12], row[13], row[14],
         row[15]);
  }
  return pose;
}

double number_from(const py::handle& value, const std::string& what) {
  const double number = PyFloat_AsDouble(value.ptr());
  if (PyErr_Occurred() != nullptr) {
    PyErr_Clear();
    fail("{}: a number is needed, this is {} of {}", what, shown(value), type_text(value));
  }
  return number;
}

py::int_ whole_number_within(const py::handle& value, const std::string& what, const py::int_& low,
                             const py::int_& high) {
  const auto index = py::reinterpret_steal<py::object>(PyNumber_Index(value.ptr()));
  if (!index) {
    PyErr_Clear();
    fail("{}: a whole number is needed, this is {} of {}", what, shown(value), type_text(value));
  }
  if (index < low || index > high) {
    fail("{}: {} is not allowed; allowed is from {} to {}", what, shown(index), shown(low), shown(high));
  }
  return py::reinterpret_borrow<py::int_>(index);
}

py::sequence sequence_from(const py::handle& value, const char* what) {
  if (!py::isinstance<py::sequence>(value)) fail("{}: a list is needed, this is a {}", what, type_text(value));
  return py::reinterpret_borrow<py::sequence>(value);
}

void for_each_item(const py::handle& value, const char* what, const std::function<void(const py::object&)>& use) {
  auto iterator = py::reinterpret_steal<py::iterator>(PyObject_GetIter(value.ptr()));
  if (!iterator) {
    PyErr_Clear();
    fail("{}: a list is needed, this is a {}", what, type_text(value));
  }
  for (; iterator != py::iterator::sentinel(); ++iterator) use(py::reinterpret_borrow<py::object>(*iterator));
}

std::string path_from(const py::handle& value, const char* what) {
  PyObject* bytes = nullptr;
  if (PyUnicode_FSConverter(value.ptr(), &bytes) == 0) {
    const bool zero = PyErr_ExceptionMatches(PyExc_ValueError) != 0 && PyErr_ExceptionMatches(PyExc_UnicodeError) == 0;
    PyErr_Clear();
    if (zero) fail("{}: {} has a zero byte, which no path may have", what, shown(value));
    fail("{}: a path is needed, this is {} of {}", what, shown(value), type_text(value));
  }
  return py::reinterpret_steal<py::bytes>(bytes);
}

std::string needed_path(const py::handle& value, const char* what) {
  std::string path = path_from(value, what);
  if (path.empty()) fail("{}: '' is no path", what);
  return path;
}

std::string text_from(const py::handle& value, const char* what) {
  if (!py::isinstance<py::str>(value))
    fail("{}: a text is needed, this is {} of {}", what, shown(value), type_text(value));
  py::ssize_t size = 0;
  const char* const text = PyUnicode_AsUTF8AndSize(value.ptr(), &size);
  if (text == nullptr) {
    PyErr_Clear();
    fail("{}: {} has something in it that isn't a letter of Unicode", what, shown(value));
  }
  return {text, static_cast<std::size_t>(size)};
}

py::str text_of(const std::string& text) {
  const auto size = static_cast<py::ssize_t>(text.size());
  auto decoded = py::reinterpret_steal<py::str>(PyUnicode_DecodeUTF8(text.data(), size, "backslashreplace"));
  if (!decoded) throw py::error_already_set();
  return decoded;
}

Progress progress_to(const py::object& listener) {
  const std::shared_ptr<py::object> held = listener.is_none() ? nullptr : shared_under_gil(listener);
  return [held](const std::string& stage, std::int64_t done, std::int64_t total) {
    const py::gil_scoped_acquire acquire;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
    if (held) (*held)(stage, done, total);
  };
}

}  // namespace touchstone::python
