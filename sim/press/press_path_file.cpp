#include "sim/press/press_path_file.h"

#include <string_view>

#include "core/error.h"
#include "core/matrix_file.h"
#include "core/sha256.h"
#include "core/whole_file.h"

namespace touchstone::sim {
namespace {

// A matrix file (core/matrix_file.h) of one column a state; after the matrices why the path stopped.
constexpr std::string_view kMagic = "TSPRPATH";
constexpr int kScalars = 34;
constexpr int kCounts = 8;  // of them, at the end
constexpr double kMostCount = 1e9;

/// Takes each number of the state to or from a column, in one order. `visit` gets a reference.
template <typename State, typename Visit>
void each_scalar(State& state, const Visit& visit) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) visit(state.gel_from_object.rotation(i, j));
    visit(state.gel_from_object.translation[i]);
  }
  for (int i = 0; i < 6; ++i) visit(state.wrench[i]);
  visit(state.largest_penetration);
  visit(state.largest_tension);
  visit(state.cone_violation);
  visit(state.contact_residual);
  visit(state.largest_gradient);
  visit(state.largest_strain);
  visit(state.contact_area);
  visit(state.contact_vertices);
  visit(state.under_resolved);
  visit(state.candidates);
  visit(state.geometry_updates);
  visit(state.solves);
  visit(state.factorisations);
  visit(state.sweeps);
  visit(state.parts);
}

Eigen::VectorXd flat(const Eigen::MatrixX3d& rows) {
  return Eigen::Map<const Eigen::VectorXd>(rows.data(), rows.size());
}

Eigen::MatrixX3d rows_of(const Eigen::VectorXd& numbers) {
  return Eigen::Map<const Eigen::MatrixX3d>(numbers.data(), numbers.size() / 3, 3);
}

}  // namespace

std::string press_path_key(const std::string& gel_key, const PressPath& path) {
  Sha256 sum;
  sum.add("touchstone presses at finite strain, format " + std::to_string(kPressPathFormat) + ", of " + gel_key);
  const auto number = [&](double value) {
    value += 0.0;  // -0 and 0 are one path
    sum.add(&value, sizeof(value));
  };
  number(static_cast<double>(path.shape.index()));
  if (const auto* ball = std::get_if<fem::SphereShape>(&path.shape)) number(ball->radius);
  if (const auto* cylinder = std::get_if<fem::RoundedCylinder>(&path.shape)) {
    for (const double value : {cylinder->radius, cylinder->edge_radius, cylinder->height}) number(value);
  }
  if (const auto* box = std::get_if<fem::BoxShape>(&path.shape)) {
    for (const double value : box->size) number(value);
  }
  number(path.friction);
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) number(path.rotation(i, j));
  }
  for (const double value : path.place_mm) number(value);
  for (const PathPoint& point : path.points) {
    number(point.at);
    for (const double value : point.shift_mm) number(value);
  }
  return sum.digest();
}

void write_press_path(const std::filesystem::path& file, const std::string& key, const PlayedPath& played) {
  TS_ASSERT(played.at.size() == played.states.size());
  const auto count = static_cast<Eigen::Index>(played.states.size());
  const auto first = [&](auto&& size) { return count > 0 ? static_cast<Eigen::Index>(size(played.states[0])) : 0; };
  Eigen::MatrixXd scalars(kScalars, count);
  Eigen::MatrixXd traction(first([](const auto& s) { return s.traction.size(); }), count);
  Eigen::MatrixXd surface(first([](const auto& s) { return s.surface_displacement.size(); }), count);
  Eigen::MatrixXd beads(first([](const auto& s) { return s.bead_displacement.size(); }), count);
  Eigen::MatrixXd contact(first([](const auto& s) { return s.node_state.size(); }), count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const fem::PressState& state = played.states[static_cast<std::size_t>(k)];
    int row = 0;
    scalars(row++, k) = played.at[static_cast<std::size_t>(k)];
    each_scalar(state, [&](const auto& value) { scalars(row++, k) = static_cast<double>(value); });
    TS_ASSERT(row == kScalars);
    traction.col(k) = flat(state.traction);
    surface.col(k) = flat(state.surface_displacement);
    beads.col(k) = flat(state.bead_displacement);
    for (Eigen::Index v = 0; v < contact.rows(); ++v) {
      contact(v, k) = static_cast<double>(state.node_state[static_cast<std::size_t>(v)]);
    }
  }
  write_whole_file(file, matrix_file(kMagic, key, {scalars, traction, surface, beads, contact}, played.stopped));
}

PlayedPath read_press_path(const std::filesystem::path& file, const std::string& key) {
  const std::string content = read_whole_file(file);
  MatrixFile matrices(content, kMagic, "a path's presses", key, "gel or path");
  const Eigen::MatrixXd scalars = matrices.take();
  const Eigen::MatrixXd traction = matrices.take();
  const Eigen::MatrixXd surface = matrices.take();
  const Eigen::MatrixXd beads = matrices.take();
  const Eigen::MatrixXd contact = matrices.take();
  const Eigen::Index count = scalars.cols();
  if (scalars.rows() != kScalars || traction.cols() != count || surface.cols() != count || beads.cols() != count ||
      contact.cols() != count || traction.rows() != surface.rows() || traction.rows() != 3 * contact.rows() ||
      beads.rows() % 3 != 0) {
    fail("its matrices don't fit each other");
  }
  if (!scalars.allFinite() || !traction.allFinite() || !surface.allFinite() || !beads.allFinite() ||
      (count > 0 && !(scalars.bottomRows(kCounts).array().abs() <= kMostCount).all()) ||
      !(contact.array() == 0.0 || contact.array() == 1.0 || contact.array() == 2.0).all()) {
    fail("it has numbers that aren't a press's");
  }
  PlayedPath played;
  played.stopped = std::string(matrices.rest());
  for (Eigen::Index k = 0; k < count; ++k) {
    fem::PressState state;
    int row = 0;
    played.at.push_back(scalars(row++, k));
    each_scalar(state, [&](auto& value) { value = static_cast<std::decay_t<decltype(value)>>(scalars(row++, k)); });
    state.traction = rows_of(traction.col(k));
    state.surface_displacement = rows_of(surface.col(k));
    state.bead_displacement = rows_of(beads.col(k));
    for (Eigen::Index v = 0; v < contact.rows(); ++v) {
      state.node_state.push_back(static_cast<fem::NodeState>(static_cast<int>(contact(v, k))));
      state.node_owner.push_back(state.node_state.back() == fem::NodeState::open ? -1 : 0);
    }
    state.bodies = {{state.gel_from_object, state.wrench, state.contact_area, state.contact_vertices}};
    played.states.push_back(std::move(state));
  }
  return played;
}

}  // namespace touchstone::sim
