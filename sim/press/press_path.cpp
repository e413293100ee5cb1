#include "sim/press/press_path.h"

#include <algorithm>
#include <cmath>
#include <system_error>
#include <utility>

#include "core/error.h"
#include "fem/contact/press_part.h"
#include "fem/contact/press_target.h"
#include "fem/finite_strain/finite_press.h"
#include "sim/press/gel_setup.h"
#include "sim/press/press_path_file.h"
#include "sim/press/state_between.h"

namespace touchstone::sim {
namespace {

void check(const PressPath& path) {
  if (path.points.empty()) fail("the path has no points");
  for (std::size_t k = 0; k < path.points.size(); ++k) {
    const PathPoint& point = path.points[k];
    if (!std::isfinite(point.at) || !point.shift_mm.allFinite()) {
      fail("point {} of the path isn't finite: at {}, shift {}, {}, {} mm", k, point.at, point.shift_mm.x(),
           point.shift_mm.y(), point.shift_mm.z());
    }
    if (k > 0 && !(point.at > path.points[k - 1].at)) {
      fail("point {} of the path is at {}, which isn't beyond the {} of the one before", k, point.at,
           path.points[k - 1].at);
    }
  }
  if (!path.place_mm.allFinite()) {
    fail("the path's place ({}, {}) mm isn't finite", path.place_mm.x(), path.place_mm.y());
  }
  fem::check_shape(shape_of(path));
}

}  // namespace

fem::ContactShape shape_of(const PressPath& path) {
  return std::visit([](const auto& shape) -> fem::ContactShape { return shape; }, path.shape);
}

fem::PressState PlayedPath::state(double place) const {
  if (at.empty() || !(place >= at.front() && place <= at.back())) {
    fail("the place {:.6g} isn't on the path, which {}{}{}", place,
         at.empty() ? std::string("has no states") : fmt::format("goes from {:.6g} to {:.6g}", at.front(), at.back()),
         stopped.empty() ? "" : ": ", stopped);
  }
  const auto above = std::upper_bound(at.begin(), at.end() - 1, place) - at.begin();
  const std::size_t upper = static_cast<std::size_t>(std::max<std::ptrdiff_t>(above, 1));
  if (at.size() == 1) return states.front();
  return state_between(states[upper - 1], states[upper], (place - at[upper - 1]) / (at[upper] - at[upper - 1]));
}

PlayedPath play_path(const fem::FiniteGel& gel, const PressPath& path, const Progress& progress) {
  check(path);
  fem::FinitePress press(gel, shape_of(path), path.friction);
  fem::PressTarget target;
  target.rotation = path.rotation;
  fem::check_target(target);
  const std::optional<RigidTransform> touch =
      press.touching({path.rotation, {path.place_mm.x(), path.place_mm.y(), 0.0}});
  if (!touch) fail("the object isn't over the gel at ({:.4g}, {:.4g}) mm", path.place_mm.x(), path.place_mm.y());
  PlayedPath played;
  for (const PathPoint& point : path.points) {
    for (int a = 0; a < 3; ++a) target.axis[a] = fem::AxisControl::at(touch->translation[a] + point.shift_mm[a]);
    try {
      played.states.push_back(press.step(target));
    } catch (const Error& error) {
      played.stopped = fmt::format("at {:.6g}: {}", point.at, error.what());
      break;
    }
    played.at.push_back(point.at);
    if (progress) {
      progress("presses at finite strain", static_cast<std::int64_t>(played.at.size()),
               static_cast<std::int64_t>(path.points.size()));
    }
  }
  return played;
}

PathPlayer::PathPlayer(const DeviceSpec& device, std::filesystem::path cache_folder)
    : device_(device), folder_(std::move(cache_folder)) {
  if (device.mesh.force_error) {
    fail("presses at finite strain need a mesh that is given by fine_mm: {} gives it by force_error", device.name);
  }
  gel_key_ = gel_key(device);
}

std::filesystem::path PathPlayer::file_of(const PressPath& path) const {
  return folder_ / ("press-path-" + press_path_key(gel_key_, path) + ".bin");
}

PlayedPath PathPlayer::play(const PressPath& path, const Progress& progress) {
  check(path);
  const std::string key = press_path_key(gel_key_, path);
  std::string note;
  std::error_code ignored;
  if (!folder_.empty() && std::filesystem::exists(file_of(path), ignored)) {
    try {
      return read_press_path(file_of(path), key);
    } catch (const Error& error) {
      note = fmt::format("the presses {} were made anew: {}", file_of(path).string(), error.what());
    }
  }
  if (!gel_) gel_ = set_up_finite_gel(device_);
  PlayedPath played = play_path(*gel_, path, progress);
  ++played_;
  if (!folder_.empty()) {
    try {
      std::filesystem::create_directories(folder_, ignored);
      write_press_path(file_of(path), key, played);
    } catch (const std::exception& error) {
      note += fmt::format("{}the presses couldn't be kept: {}", note.empty() ? "" : "; ", error.what());
    }
  }
  played.note = note;
  return played;
}

}  // namespace touchstone::sim
