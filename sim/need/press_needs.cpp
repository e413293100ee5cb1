#include "sim/need/press_needs.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/error.h"
#include "core/units.h"
#include "fem/finite_strain/finite_press.h"
#include "fem/mesh/gel_body.h"
#include "sim/need/hard_states.h"
#include "sim/need/switched_effect.h"
#include "sim/plan/change_units.h"
#include "sim/plan/image_motion.h"
#include "sim/press/elastic_object.h"
#include "sim/press/gel_setup.h"
#include "sim/scene/device_gel.h"
#include "sim/view/marker_motion.h"

namespace touchstone::sim {
namespace {

/// Forces smaller than this part of the largest one are judged as if they had it.
constexpr double kLeastForce = 0.05;
/// The finite-strain press isn't made on a coarser mesh than this, unless the device's own is: parts of the gel's
/// thickness and of the contact's radius.
constexpr double kEdgePerThickness = 0.2;
constexpr double kEdgePerContact = 0.4;
/// How far its fine part goes, in the contact's radius, and how coarse the rest may be.
constexpr double kReachPerContact = 1.5;
constexpr double kCoarsePerThickness = 0.5;
/// Of a stage of the finite-strain press: one that takes more has no answer.
constexpr int kMostFactorisations = 24;
/// Parts of the way from the first touch to the hardest pose. Where one has no answer, what was found before it is
/// taken to grow in proportion: strains do.
constexpr std::array<double, 3> kStages = {0.25, 0.5, 1.0};

/// Two answers to one state.
struct Pair {
  const fem::PressState& with;
  const fem::PressState& without;
};

/// What a scene's owner would see of a difference of presses on `gel`.
class PressComparison {
 public:
  PressComparison(const SceneSpec& scene, const fem::Compliance& gel)
      : gel_(gel), heights_(scene.device.coating.has_value() || scene.outputs.height) {
    if (!scene.device.camera || !scene.outputs.camera()) return;
    scale_.emplace(scene.device);
    markers_ = marker_places(scene.device, gel);
  }

  void add(const Pair& pair, double largest_force) {
    for (std::size_t b = 0; b < pair.with.bodies.size(); ++b) {
      const Eigen::Vector3d with = pair.with.bodies[b].wrench.head<3>();
      const Eigen::Vector3d without = pair.without.bodies[b].wrench.head<3>();
      const double size = std::max(with.norm(), kLeastForce * largest_force);
      if (size > 0.0) raise(change_.force_percent, 100.0 * (with - without).norm() / size);
    }
    if (heights_) {
      const auto rise = pair.with.surface_displacement.col(2) - pair.without.surface_displacement.col(2);
      raise(change_.height_um, 1e3 * rise.cwiseAbs().maxCoeff());
    }
    if (!scale_) return;
    add_places(pair.with.bead_displacement, pair.without.bead_displacement);
    if (markers_.rest_mm.rows() > 0) {
      add_places(marker_displacement(markers_, gel_, pair.with), marker_displacement(markers_, gel_, pair.without));
    }
  }

  const Change& change() const { return change_; }

 private:
  static void raise(std::optional<double>& amount, double to) { amount = std::max(amount.value_or(0.0), to); }

  void add_places(const Eigen::MatrixX3d& one, const Eigen::MatrixX3d& other) {
    for (Eigen::Index k = 0; k < one.rows(); ++k) {
      raise(change_.marker_px, scale_->pixels((one.row(k) - other.row(k)).transpose()));
    }
  }

  const fem::Compliance& gel_;
  bool heights_;
  std::optional<ImageScale> scale_;
  MarkerPlaces markers_;
  Change change_;
};

constexpr SwitchedEffect kPlayed[] = {
    {"friction", &EffectSwitches::friction, &Plan::friction},
    {"elastic object", &EffectSwitches::elastic_object, &Plan::elastic_object},
};

/// Gives the device a mesh that is fine where the object touches alone: for a press that is about the strain there.
/// With `edges` of 1 it stays as it is. @returns where the object stands: of a slab, where one place is as good as
/// another, over its middle
RigidTransform cut_to_contact(DeviceSpec& device, const fem::BodyState& hardest, double edges) {
  RigidTransform pose = hardest.gel_from_object;
  if (edges <= 1.0) return pose;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const double contact = std::sqrt(hardest.contact_area / kPi);
  MeshSpec& mesh = device.mesh;
  const double most = std::min(kEdgePerThickness * device.gel.thickness_mm, kEdgePerContact * contact);
  const double own = mesh.fine_mm;
  mesh.fine_mm *= std::clamp(most / own, 1.0, edges);
  mesh.coarse_mm =
      std::max(mesh.coarse_mm, std::min(edges * mesh.coarse_mm, kCoarsePerThickness * device.gel.thickness_mm));
  double reach = kReachPerContact * contact + mesh.fine_mm;
  if (device.gel.slab() != nullptr) {
    middle.head<2>() = pose.translation.head<2>();
  } else {
    reach += pose.translation.head<2>().norm();
  }
  mesh.fine_half_extent_mm = mesh.fine_half_extent_mm.cwiseMin(reach);
  mesh.fine_depth_mm = std::min(mesh.fine_depth_mm, std::max(contact, 2.0 * mesh.fine_mm));
  pose.translation -= middle;
  return pose;
}

Change scaled(Change change, double factor) {
  for (const ChangeUnit& unit : kChangeUnits) {
    if (change.*unit.changed) *(change.*unit.changed) *= factor;
  }
  return change;
}

void raise_to(Change& change, const Change& other) {
  for (const ChangeUnit& unit : kChangeUnits) {
    const std::optional<double>& amount = other.*unit.changed;
    if (amount) change.*unit.changed = std::max((change.*unit.changed).value_or(0.0), *amount);
  }
}

double largest_force(std::span<const Truth> truths) {
  double largest = 0.0;
  for (const Truth& truth : truths) largest = std::max(largest, strongest_force(truth.press));
  return largest;
}

fem::PressTarget target_at(const RigidTransform& pose) {
  fem::PressTarget target;
  target.rotation = pose.rotation;
  for (int a = 0; a < 3; ++a) target.axis[a] = fem::AxisControl::at(pose.translation[a]);
  return target;
}

}  // namespace

void add_played_needs(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel,
                      std::span<const Truth> truths, std::span<const int> frames, const std::filesystem::path& cache,
                      SceneNeeds& needs) {
  for (const SwitchedEffect& one : kPlayed) {
    const bool on = plan.*one.planned;
    const std::optional<SwitchedScene> other = switched(scene, plan, one);
    if (!other) continue;
    EffectNeed need{one.name, {}, {}};
    try {
      const std::vector<Truth> others = play_for_need(other->scene, other->plan, gel, cache);
      PressComparison comparison(scene, gel);
      for (const int k : frames) {
        const fem::PressState& planned = truths[static_cast<std::size_t>(k)].press;
        const fem::PressState& turned = others[static_cast<std::size_t>(k)].press;
        comparison.add(on ? Pair{planned, turned} : Pair{turned, planned}, largest_force(truths));
      }
      need.change = comparison.change();
    } catch (const Error& error) {
      need.note = error.what();
    }
    needs.push_back(std::move(need));
  }
}

namespace {

/// What finite strain changes of one object's press. Where there's no answer, `note` says why. @throws Error likewise
std::optional<Change> finite_strain_change(const SceneSpec& scene, const fem::PressBody& object,
                                           const fem::BodyState& hardest, double edges, std::string& note) {
  SceneSpec coarse = scene;
  const RigidTransform pose = cut_to_contact(coarse.device, hardest, edges);
  const std::vector<fem::ElasticMaterial> materials = gel_materials(coarse.device.gel);
  const std::vector<fem::Bead> beads = gel_beads(coarse.device);
  const fem::GelBody body = gel_body(coarse.device);
  const fem::TetMesh mesh = fem::mesh_gel(body);
  const fem::Compliance linear_gel = fem::compute_compliance(mesh, materials, beads, fem::thickness_of(body));
  const fem::FiniteGel finite_gel(mesh, materials, beads, fem::thickness_of(body));
  // Both with whole hats, so that they differ by what the strain makes of them alone.
  fem::PressTolerance tolerance;
  tolerance.outlines = false;
  fem::Press linear(linear_gel, std::vector{object}, tolerance);
  tolerance.most_factorisations = kMostFactorisations;
  fem::FinitePress finite(finite_gel, object, tolerance);
  const std::optional<RigidTransform> touching = finite.touching(pose);
  if (!touching) fail("the object isn't over the gel");
  std::optional<Change> change;
  for (const double part : kStages) {
    RigidTransform next = pose;
    next.translation += (1.0 - part) * (touching->translation - pose.translation);
    try {
      linear.step(target_at(next));
      finite.step(target_at(next));
    } catch (const Error& error) {
      note = error.what();
      break;
    }
    PressComparison comparison(coarse, linear_gel);
    comparison.add({finite.state(), linear.state()}, 0.0);
    change = scaled(comparison.change(), 1.0 / part);
  }
  return change;
}

}  // namespace

void add_finite_strain_need(const SceneSpec& scene, const Plan& plan, const Truth& hardest, double edges,
                            const std::filesystem::path& cache, SceneNeeds& needs) {
  if (scene.device.mesh.force_error) return;
  EffectNeed need{"finite strain", {}, {}};
  try {
    const auto elastic = set_up_elastic_objects(scene, plan, cache);
    const std::vector<MovedObject> objects = moved_objects(scene);
    for (std::size_t b = 0; b < objects.size(); ++b) {
      const fem::BodyState& state = hardest.press.bodies[b];
      if (state.contact_vertices == 0) continue;
      fem::PressBody object;
      object.shape = coarse_contact_shape(objects[b].object, scene.device.mesh.fine_mm);
      object.friction = plan.friction ? objects[b].object.friction : 0.0;
      if (plan.elastic_object) object.elastic = elastic[b];
      const std::optional<Change> change = finite_strain_change(scene, object, state, edges, need.note);
      if (!change) continue;
      if (!need.change) need.change.emplace();
      raise_to(*need.change, *change);
    }
    if (need.change) need.note.clear();
  } catch (const Error& error) {
    need.note = error.what();
  }
  needs.push_back(std::move(need));
}

}  // namespace touchstone::sim
