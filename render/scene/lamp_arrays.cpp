#include "render/scene/lamp_arrays.h"

#include <cmath>
#include <cstddef>

#include "core/error.h"
#include "core/random.h"
#include "core/units.h"
#include "render/sampling/warps.h"

namespace touchstone::render {
namespace {

constexpr int kMostLeds = 1000;

void check(int count, const LedSpread& spread, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  if (count < 1 || count > kMostLeds) fail("LED array: {} LEDs; it must be from 1 to {}", count, kMostLeds);
  if (!(spread.power >= 0.0 && spread.power <= 2.0)) {
    fail("LED array: the spread of power is {}; it must be from 0 to 2", spread.power);
  }
  if (!(spread.tilt >= 0.0 && spread.tilt <= 0.5)) {
    fail("LED array: the spread of tilt is {} rad; it must be from 0 to 0.5", spread.tilt);
  }
  if (!a.allFinite() || !b.allFinite()) fail("LED array: its places aren't finite");
}

/// The LED as a factory might have made it.
LedLamp made(LedLamp led, const LedSpread& spread, std::size_t number) {
  RandomStream random(spread.seed, number, Purpose::kLampSpread);
  const double power = random.normal();
  const double lean_x = random.normal();
  const double lean_y = random.normal();
  // A lognormal factor of mean one.
  if (spread.power > 0.0) led.power_W *= std::exp(spread.power * power - 0.5 * spread.power * spread.power);
  if (spread.tilt > 0.0) {
    const NormalFrame frame(led.direction.normalized());
    const double angle = spread.tilt * std::hypot(lean_x, lean_y);
    const Eigen::Vector3d lean = (lean_x * frame.x + lean_y * frame.y).normalized();
    led.direction = std::cos(angle) * frame.z + std::sin(angle) * lean;
  }
  return led;
}

}  // namespace

std::vector<LedLamp> led_strip(const LedLamp& like, const Eigen::Vector3d& from, const Eigen::Vector3d& to, int count,
                               const LedSpread& spread) {
  check(count, spread, from, to);
  std::vector<LedLamp> leds;
  for (int i = 0; i < count; ++i) {
    LedLamp led = like;
    const double part = count == 1 ? 0.5 : static_cast<double>(i) / (count - 1);
    led.position = (1.0 - part) * from + part * to;
    leds.push_back(made(led, spread, leds.size()));
  }
  return leds;
}

std::vector<LedLamp> led_ring(const LedLamp& like, const Eigen::Vector3d& centre, double radius,
                              const Eigen::Vector3d& aim, int count, const LedSpread& spread) {
  check(count, spread, centre, aim);
  if (!(radius > 0.0 && std::isfinite(radius))) fail("LED ring: radius is {} mm; it must be above 0", radius);
  std::vector<LedLamp> leds;
  for (int i = 0; i < count; ++i) {
    LedLamp led = like;
    const double azimuth = 2.0 * kPi * i / count;
    led.position = centre + radius * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0.0);
    led.direction = aim - led.position;
    leds.push_back(made(led, spread, leds.size()));
  }
  return leds;
}

std::vector<LedLamp> led_array(const LedLamp& like, const Eigen::Vector3d& corner, const Eigen::Vector3d& side_a,
                               const Eigen::Vector3d& side_b, int columns, int rows, const LedSpread& spread) {
  if (columns < 1 || rows < 1 || columns > kMostLeds || rows > kMostLeds) {
    fail("LED array: {} columns and {} rows; each must be from 1 to {}", columns, rows, kMostLeds);
  }
  check(columns * rows, spread, corner, side_a + side_b);
  std::vector<LedLamp> leds;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      LedLamp led = like;
      led.position = corner + (column + 0.5) / columns * side_a + (row + 0.5) / rows * side_b;
      leds.push_back(made(led, spread, leds.size()));
    }
  }
  return leds;
}

}  // namespace touchstone::render
