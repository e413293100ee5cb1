#include "python/src/ball_presses.h"

#include "core/error.h"
#include "core/yaml_reader.h"

namespace touchstone::python {
namespace {

constexpr double kLargestPlace_px = 1e6;
const Allowed kScales = Allowed::within(1e-4, 10.0);            // of a pixel, mm; as the command's --mm-per-px
const Allowed kBallDiameters = Allowed::above_up_to(0.0, 1e4);  // mm; an object's radius may be as much

}  // namespace

std::vector<sensors::BallPress> GivenPresses::presses(const Find& find) const {
  std::vector<sensors::BallPress> presses;
  for (std::size_t i = 0; i < pictures.size(); ++i) {
    sensors::BallPress press;
    press.name = fmt::format("frame {}", i);
    press.frame = pictures[i].mat;
    press.ball_radius_mm = radii_mm[i];
    press.circle = circles[i];
    if (!press.circle && find) press.circle = find(press);
    presses.push_back(std::move(press));
  }
  return presses;
}

GivenPresses presses_from(const py::object& frames, const py::object& ball_diameters_mm, const py::object& circles) {
  GivenPresses given;
  given.pictures = pictures_from(frames, "frames");
  const std::size_t count = given.pictures.size();
  const py::sequence diameters = sequence_from(ball_diameters_mm, "ball_diameters_mm");
  const bool circles_given = !circles.is_none();
  const py::sequence outlines = sequence_from(circles_given ? circles : py::object(py::tuple()), "circles");
  if (diameters.size() != count) fail("ball_diameters_mm: there are {} for {} frames", diameters.size(), count);
  if (circles_given && outlines.size() != count) fail("circles: there are {} for {} frames", outlines.size(), count);
  given.circles.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const double diameter = number_from(diameters[i], fmt::format("ball_diameters_mm: number {} of it", i));
    if (!kBallDiameters.holds(diameter)) {
      fail("ball_diameters_mm: number {} of it is {}; allowed is {}", i, diameter, kBallDiameters.text());
    }
    given.radii_mm.push_back(0.5 * diameter);
    if (!circles_given) continue;
    const py::object circle = outlines[i];
    if (circle.is_none()) continue;
    const Eigen::Vector3d numbers = vector3_from(circle, "circles");
    if (!(numbers.cwiseAbs().maxCoeff() <= kLargestPlace_px)) {
      fail("circles: number {} of it is ({:g}, {:g}, {:g}) px; allowed is up to {} each", i, numbers.x(), numbers.y(),
           numbers.z(), kLargestPlace_px);
    }
    given.circles[i] = sensors::ContactCircle{numbers.head<2>(), numbers.z()};
  }
  return given;
}

void require_scale(double mm_per_px) {
  if (!kScales.holds(mm_per_px)) fail("mm_per_px: {} is not allowed; allowed is {}", mm_per_px, kScales.text());
}

}  // namespace touchstone::python
