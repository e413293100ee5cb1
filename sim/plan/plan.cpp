#include "sim/plan/plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "core/units.h"
#include "fem/fine_relief/smooth_surface.h"
#include "fem/vibration/vibration.h"
#include "sim/plan/plan_direct.h"
#include "sim/plan/plan_pipeline.h"
#include "sim/plan/plan_table.h"
#include "sim/plan/plan_time.h"
#include "sim/plan/plan_warnings.h"
#include "sim/plan/scene_bands.h"
#include "sim/scene/device_gel.h"
#include "sim/scene/device_imager.h"
#include "sim/scene/translucent_coat.h"

namespace touchstone::sim {
namespace {

constexpr double kEdgesADetail = 4.0;     // a wave needs so many for its shape
constexpr double kPixelsAnEdge = 10.0;    // for objects without detail: 0.3 um and a degree off under a ball of 4 mm
constexpr double kAllowedInertia = 0.04;  // of a vibration's force: a fifth of the lowest eigenfrequency

/// Fresnel reflectance of unpolarised light that meets a face from index n1 at sine `sine` towards index n2.
double fresnel(double n1, double n2, double sine) {
  const double sine2 = n1 / n2 * sine;
  if (sine2 >= 1.0) return 1.0;
  const double c1 = std::sqrt(1.0 - sine * sine);
  const double c2 = std::sqrt(1.0 - sine2 * sine2);
  const double s = (n1 * c1 - n2 * c2) / (n1 * c1 + n2 * c2);
  const double p = (n1 * c2 - n2 * c1) / (n1 * c2 + n2 * c1);
  return (s * s + p * p) / 2;
}

/// Part of a disc of radius `radius` that its copy moved sideways by `shift` covers.
double disc_overlap(double radius, double shift) {
  const double x = shift / (2.0 * radius);
  if (x >= 1.0) return 0.0;
  return 2.0 / kPi * (std::acos(x) - x * std::sqrt(1.0 - x * x));
}

/// Radius of the largest disc of the object that the gel can be wetted by.
double bright_radius(const ObjectSpec& object) {
  switch (object.shape.type) {
    case ShapeKind::sphere:
    case ShapeKind::rounded_cylinder:
      return object.shape.radius_mm;
    case ShapeKind::box:
      return object.shape.size_mm.head<2>().norm() / 2;
    case ShapeKind::mesh:
    case ShapeKind::egg:
    case ShapeKind::shell:
    case ShapeKind::hexagon:
    case ShapeKind::cone:
    case ShapeKind::torus:
    case ShapeKind::capsule:
    case ShapeKind::lying_cylinder:
    case ShapeKind::wedge:
      break;
  }
  double radius = 0.0;
  for (const Eigen::Vector3d& vertex : visible_mesh(object.shape).vertices) {
    radius = std::max(radius, vertex.head<2>().norm());
  }
  return radius;
}

/// Radius of the largest disc that a gel's coat has, seen along z. @pre pictures can be had of it: it isn't a mesh
double coat_radius(const GelSpec& gel) {
  if (const auto face = round_face(gel)) return face->radius_mm;
  const auto& slab = std::get<SlabSpec>(gel.shape);
  return 0.5 * std::hypot(slab.size_x_mm, slab.size_y_mm);
}

void plan_elastic_objects(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const ElasticSpec* softest = nullptr;
  for (const MovedObject& moved : moved_objects(scene)) {
    const auto& elastic = moved.object.elastic;
    if (elastic && (softest == nullptr || elastic->youngs_modulus_MPa < softest->youngs_modulus_MPa)) {
      softest = &*elastic;
    }
  }
  if (softest == nullptr && scene.effects.elastic_object == Switch::on) {
    fail_at(scene.where, "effects.elastic_object: on, but no object has the field `elastic` with its modulus");
  }
  plan.elastic_object =
      table.add("elastic object", scene.effects.elastic_object, softest != nullptr,
                softest == nullptr ? "no object has a finite Young's modulus: all are rigid"
                                   : fmt::format("an object's Young's modulus is {:.3g} MPa, the gel's {:.3g} MPa",
                                                 softest->youngs_modulus_MPa, scene.device.gel.youngs_modulus_MPa),
                "set-up once an object (seconds, kept in the cache), then some tens of milliseconds a frame");
}

/// What keeps a scene from being pressed at finite strain; nothing: it can be.
std::string unfit_for_finite_strain(const SceneSpec& scene, const Plan& plan) {
  if (plan.elastic_object && plan.relaxation) return "an elastic object on a gel that relaxes";
  const auto turned = [](const MovedObject& moved) { return moved.motion.is_turned(); };
  const std::vector<MovedObject> objects = moved_objects(scene);
  if (plan.relaxation && std::any_of(objects.begin(), objects.end(), turned)) {
    return "motions led by torques on a gel that relaxes";
  }
  if (plan.inertia) return "inertia";
  if (scene.device.mesh.force_error) return "a mesh that isn't given by fine_mm";
  return {};
}

void plan_finite_strain(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const Elasticity asked = scene.effects.elasticity;
  const std::string unfit = unfit_for_finite_strain(scene, plan);
  if (asked == Elasticity::neo_hookean && !unfit.empty()) {
    fail_at(scene.where, "effects.elasticity: neo_hookean can't be had with {} yet", unfit);
  }
  const std::string name = "finite strain";
  const std::string cost =
      "a factorisation of the whole gel for every fiftieth of its thickness: one to some ten seconds a frame";
  if (asked == Elasticity::neo_hookean) {
    plan.finite_strain = table.add(name, true, "the scene asks for neo-Hookean elasticity", cost);
    return;
  }
  const std::string why = table.accuracy() ? "the gel is stretched"
                                           : "linear elasticity is the default; where truth's largest strain is above "
                                             "some 0.2, effects.elasticity: neo_hookean is worth its time (`touchstone "
                                             "plan --linear-range` tells)";
  const Switch forced = asked == Elasticity::automatic ? Switch::automatic : Switch::off;
  plan.finite_strain = table.add_by_need(name, forced, false,
                                         unfit.empty() ? why : fmt::format("it can't be had with {} yet", unfit), cost);
  if (!unfit.empty()) {
    plan.finite_strain = plan.effects.back().on = false;
    plan.effects.back().cost = "nothing";
  }
  const std::optional<Change>& change = plan.effects.back().change;
  if (!unfit.empty() && asked == Elasticity::automatic && change && exceeds(*change, *table.accuracy())) {
    plan.warnings.push_back(fmt::format("{} is left out, which changes {}: it can't be had with {} yet", name,
                                        in_words(*change, *table.accuracy()), unfit));
  }
}

void plan_mechanics(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  table.add("gel mechanics", true, "truth is always asked for",
            "set-up once a gel (seconds, kept in the cache), then about a millisecond a frame");
  const std::vector<MovedObject> objects = moved_objects(scene);
  // Of the object whose friction is called for, or else of the first.
  const auto rubs = [](const MovedObject& moved) {
    return moved.motion.is_tangential() && moved.object.friction > 0.0;
  };
  const auto rubbing = std::find_if(objects.begin(), objects.end(), rubs);
  const MovedObject& judged = rubbing == objects.end() ? objects.front() : *rubbing;
  const double mu = judged.object.friction;
  const bool tangential = judged.motion.is_tangential();
  const std::string why = mu == 0.0    ? "the object's friction is 0"
                          : tangential ? fmt::format("the motion has a tangential part and friction is {}", mu)
                                       : "the motion is a straight press: no tangential part, no tilt";
  plan.friction = table.add_by_need("friction", scene.effects.friction, rubbing != objects.end(), why,
                                    "a few milliseconds a frame");

  plan_elastic_objects(scene, plan, table);

  const fem::PronySeries series = prony_series(scene.device.gel);
  const double seconds = (scene.motion.frame_count() - 1) / scene.motion.frame_rate_Hz;
  const bool relaxes = fem::lasting_share(series) < 1.0;
  const Change faded{.force_percent = 100 * (1.0 - fem::relaxation_at(series, seconds))};
  plan.relaxation = table.add_by_need(
      "stress relaxation", scene.effects.relaxation, relaxes,
      relaxes
          ? fmt::format("the gel's modulus falls by {:.1f} % within the motion's {:.3g} s and by {:.1f} % in the end",
                        100 * (1.0 - fem::relaxation_at(series, seconds)), seconds,
                        100 * (1.0 - fem::lasting_share(series)))
          : "the gel has no Prony series: it is elastic",
      "some vectors of the surface's size a frame", faded);

  double frequency = 0.0;
  bool turned = false;
  for (const MovedObject& moved : objects) {
    frequency = std::max(frequency, moved.motion.highest_vibration_Hz());
    turned = turned || moved.motion.is_turned();
  }
  const double missing = inertia_estimate(scene.device.gel, frequency);
  const double allowed = table.accuracy() ? 0.01 * table.accuracy()->force_percent : kAllowedInertia;
  const bool fast = missing > allowed;
  const bool inertia = scene.effects.inertia == Switch::automatic ? fast : scene.effects.inertia == Switch::on;
  if (inertia && objects.size() > 1) {
    fail_at(scene.where, "inertia isn't simulated with several objects; effects.inertia: off leaves it out");
  }
  if (inertia && turned) {
    fail_at(scene.where,
            "inertia isn't simulated for an object that is led by torques; effects.inertia: off leaves it out");
  }
  if (inertia && plan.elastic_object) {
    fail_at(scene.where, "inertia isn't simulated with an elastic object; switch one of them off in effects");
  }
  plan.inertia = table.add(
      "gel dynamics (inertia)", scene.effects.inertia, fast,
      frequency == 0.0 ? "the motion doesn't vibrate"
                       : fmt::format("the motion vibrates at {:.4g} Hz, a layer like the gel has its lowest "
                                     "eigenfrequency at {:.4g} Hz: leaving inertia out errs by up to some {:.2g} % of "
                                     "the vibration's force; allowed is {:.2g} %",
                                     frequency, frequency / std::sqrt(missing), 100 * missing, 100 * allowed),
      "the gel's modes once (half a minute, kept in the cache), then milliseconds a frame");
  plan_finite_strain(scene, plan, table);
}

/// Finest detail of the object, mm: of its relief, or the middle one of its mesh's edges.
std::optional<double> finest_detail(const ObjectSpec& object) {
  if (object.relief) return finest_detail(*object.relief);
  if (object.shape.type != ShapeKind::mesh) return std::nullopt;
  const TriangleMesh mesh = visible_mesh(object.shape);
  std::vector<double> edges;
  for (const auto& t : mesh.triangles) {
    for (int k = 0; k < 3; ++k) edges.push_back((mesh.vertices[t[k]] - mesh.vertices[t[(k + 1) % 3]]).norm());
  }
  const auto middle = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2);
  std::nth_element(edges.begin(), middle, edges.end());
  return *middle;
}

/// @pre the gel doesn't take fine relief
std::string shape_in_words(const GelSpec& gel) {
  const DomeSpec* dome = gel.dome();
  if (dome == nullptr) return "this gel is neither";
  return fmt::format("this dome slopes by {:.3g} degrees at its rim",
                     std::asin(dome->base_radius_mm / dome->sphere_radius_mm) / kRadiansPerDegree);
}

void plan_relief(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const bool seen = scene.outputs.camera() || scene.outputs.height;
  const double edge = scene.device.mesh.fine_mm;
  std::optional<double> detail;
  for (const MovedObject& moved : moved_objects(scene)) {
    const std::optional<double> one = finest_detail(moved.object);
    if (one) detail = detail ? std::min(*detail, *one) : one;
  }
  const bool fine = detail && *detail < kEdgesADetail * edge;
  // A coating shows each slope. On the gel's mesh a ball's contact ends on whole edges and what is free is averaged
  // over them: of edges of 0.5 mm under a ball of 4 mm the surface comes out 15 um and its slope 2 to 4 degrees off.
  const std::string unfit_object = !plan.elastic_object ? ""
                                   : plan.relaxation    ? "on a gel that relaxes"
                                   : !scene.device.coating && scene.outputs.camera()
                                       ? "that a camera sees through a clear gel"
                                       : "";
  const bool shows_slopes = scene.device.coating && scene.outputs.camera() && takes_fine_relief(scene.device.gel) &&
                            scene.more_objects.empty() && unfit_object.empty();
  const std::string why =
      shows_slopes && !fine ? "a coating shows the surface's slope, which the gel's mesh has to some degrees only"
      : !detail             ? "the object's shape is smooth: the gel's mesh has all of it"
      : !fine
          ? fmt::format("the object's finest detail of {:.3g} mm has {:.0f} or more of the gel's edges of {:.3g} mm",
                        *detail, kEdgesADetail, edge)
      : !seen ? "neither a picture nor a height map is asked for"
              : fmt::format("the object has detail of {:.3g} mm, the gel's edges have {:.3g} mm", *detail, edge);
  const std::string cost = fine ? "0.1 to 1 second a frame" : "10 to 50 milliseconds a frame";
  const bool called_for = (fine && seen) || shows_slopes;
  plan.fine_relief = table.add_by_need("fine relief", scene.effects.fine_relief, called_for, why, cost);
  if (plan.fine_relief && !scene.more_objects.empty()) {
    fail_at(scene.where, "fine relief isn't simulated with several objects; effects.fine_relief: off leaves it out");
  }
  if (plan.fine_relief && !unfit_object.empty()) {
    fail_at(scene.where, "fine relief isn't simulated with an elastic object {}; switch one of them off in effects",
            unfit_object);
  }
  if ((plan.fine_relief || scene.outputs.height) && !takes_fine_relief(scene.device.gel)) {
    fail_at(scene.where, "{} is for flat and domed gels only (domes up to {:.3g} degrees of slope); {}{}",
            plan.fine_relief ? "fine relief" : "outputs.height", fem::kSteepestDome / kRadiansPerDegree,
            shape_in_words(scene.device.gel), plan.fine_relief ? "; effects.fine_relief: off leaves it out" : "");
  }
  const double pixel = scene.membrane.pixel_um / kMicrometresPerMillimetre;
  const bool asked = fine || scene.effects.fine_relief == Switch::on;
  plan.relief_pixel_mm = asked ? pixel : std::max(pixel, edge / kPixelsAnEdge);
  // A picture may be smoother than its pixels; waves and hairs are as fine as they say.
  const bool known = scene.object.relief && is_sharp(*scene.object.relief);
  if (plan.fine_relief && known && *detail < 2.0 * pixel) {
    fail_at(scene.membrane.where,
            "membrane.pixel_um: {} is too wide for the object's relief of {:.3g} mm; at most {:.3g}",
            scene.membrane.pixel_um, *detail, 0.5 * *detail * kMicrometresPerMillimetre);
  }
}

/// The part of its light that a coating sends straight to itself, evenly bright: a cap of the height h on a sphere of
/// the radius R sends each of its places h / (2 R), as all of a sphere sends evenly to all of it. Of a fingertip its
/// round end; a flat one none.
double self_view(const GelSpec& gel) {
  if (const DomeSpec* dome = gel.dome()) {
    const double radius = dome->sphere_radius_mm;
    const double base = std::min(dome->base_radius_mm, radius);
    return 0.5 * (1.0 - std::sqrt(1.0 - base * base / (radius * radius)));
  }
  return gel.fingertip() != nullptr ? 0.5 : 0.0;
}

void plan_interreflection(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const DeviceSpec& device = scene.device;
  const GelSpec& gel = device.gel;
  plan.scattering = table.add("scattering", gel.scattering_per_mm.largest() > 0.0,
                              gel.scattering_per_mm.largest() > 0.0
                                  ? fmt::format("the gel scatters {:.3g} times a mm", gel.scattering_per_mm.largest())
                                  : "the gel is clear",
                              "every scattering is a ray, and every frame is traced whole");
  double albedo = 0.0;
  double gain = 0.0;
  const auto judge = [&](double own, double radius) {
    // What comes back after one bounce; that of all of them is the geometric series.
    const double by_plate = interreflection_estimate(gel, device.plate, own, radius);
    const double once = by_plate / (1.0 + by_plate) + (device.coating ? own * self_view(gel) : 0.0);
    const double own_gain = once / (1.0 - once);
    if (own_gain > gain) {
      albedo = own;
      gain = own_gain;
    }
  };
  if (device.coating) {
    judge(device.coating->albedo.largest(), coat_radius(gel));
  } else {
    for (const MovedObject& moved : moved_objects(scene)) {
      double brightest = moved.object.albedo.largest();
      for (const Colour& ink : inks_of(moved.object.print)) brightest = std::max(brightest, ink.largest());
      judge(moved.object.radiance ? 0.0 : brightest, bright_radius(moved.object));
    }
  }
  const std::string why = fmt::format(
      "{} of albedo {:.2g} gives itself {:.1f} % of its light{}{}", device.coating ? "a coating" : "an object", albedo,
      100 * gain, device.coating ? "" : " back through the plate",
      table.accuracy()
          ? ""
          : fmt::format("; allowed to leave out is {:.1f} %", 100 * scene.light.interreflection_tolerance));
  const std::string cost = "3 to 5 times the rays";
  if (plan.scattering) {
    plan.interreflection = table.add("interreflection", scene.effects.interreflection, true,
                                     "light is scattered many times in a milky gel", cost);
    return;
  }
  // What the room sends onto a coating is light that only a bounce brings to the camera.
  const bool lit_by_room = device.coating && device.room_radiance.largest() > 0.0;
  const bool much = lit_by_room || gain > scene.light.interreflection_tolerance;
  plan.interreflection = table.add_by_need("interreflection", scene.effects.interreflection, much,
                                           lit_by_room ? "the room lights the coating" : why, cost);
}

void plan_print(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  bool printed = false;
  bool skin = false;
  for (const MovedObject& moved : moved_objects(scene)) {
    printed = printed || !moved.object.print.empty();
    skin = skin || depends_on_pressure(moved.object.print);
  }
  const bool coated = scene.device.coating.has_value();
  const bool seen = printed && !coated && (scene.outputs.light() || scene.outputs.events);
  const char* hidden = coated ? "the gel's coating hides the objects" : "no picture is asked for";
  plan.object_print = table.add("print on objects", seen,
                                !printed ? "nothing is printed on an object"
                                : seen   ? "an object is printed on and the gel is clear"
                                         : hidden,
                                "a look-up a hit; pictures are turned into bands once a frame");
  plan.skin_blanching = table.add("skin under pressure", seen && skin,
                                  !skin  ? "no object has a skin's marks"
                                  : seen ? "blood is pressed out of a skin's vessels, which its colour shows"
                                         : hidden,
                                  "some milliseconds a frame");
  if (plan.skin_blanching && plan.fine_relief) {
    fail_at(scene.where,
            "a skin's marks can't be had with fine relief, which has no map of pressure for them; "
            "effects.fine_relief: off leaves that out");
  }
}

void plan_bands(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  std::optional<double> tolerance;
  if (table.accuracy()) tolerance = table.accuracy()->pixel_noise * least_noise_share(*scene.device.camera);
  plan.bands = choose_bands(scene, tolerance);
  check_light(scene, plan.bands);
  const int count = plan.bands.count();
  const std::string why =
      plan.bands.ranges
          ? fmt::format(
                "between {:.4g} and {:.4g} nm they get what a pixel reads wrong by up to {:.2g} % (wanted {:.2g} %)",
                scene.device.bands->from_nm, scene.device.bands->to_nm, 100 * band_error(scene, plan.bands),
                100 * tolerance.value_or(scene.device.bands->tolerance))
          : fmt::format("the device gives its colours as numbers for {}",
                        count == 1 ? "one band" : fmt::format("{} bands", count));
  table.add("spectral bands", true, why, fmt::format("{} band{} a path", count, count == 1 ? "" : "s"));
}

void plan_translucent_coating(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const DeviceSpec& device = scene.device;
  const bool translucent = device.coating && device.coating->transmittance.largest() > 0.0;
  if (!translucent) {
    const char* why = device.coating ? "the coating lets no light through" : "the gel has no coating";
    plan.translucent_coating = table.add("translucent coating", false, why, "");
    return;
  }
  const double change = largest_change(translucent_coat(scene, plan.bands));
  const double least = 0.5 / ((1 << device.camera->bits) - 1);
  const Change seen{.pixel_noise = change / least_noise_share(*device.camera)};
  plan.translucent_coating = table.add_by_need(
      "translucent coating", scene.effects.translucent_coating, change >= least,
      fmt::format(
          "what touches the coating makes it brighter or darker by up to {:.2g} %; half a digital number is {:.2g} %",
          100 * change, 100 * least),
      "a look-up a hit", seen);
}

void plan_light(const SceneSpec& scene, Plan& plan, PlanTable& table) {
  const bool images = scene.outputs.camera();
  plan.camera = table.add(
      "camera and renderer", images,
      images ? "an image or a stream of events is asked for" : "no image is asked for: truth alone needs none",
      "most of the time of a frame");
  if (!images) return;
  if (!scene.device.camera) {
    fail_at(scene.where, "outputs: an image is asked for, but the device '{}' ({}) has no camera", scene.device.name,
            scene.device.where.file);
  }
  const bool hits = scene.outputs.first_hits();
  table.add(
      "truth of pixels", hits,
      hits ? "depth, normals, ids, contact or flow is asked for" : "none of depth, normals, ids, contact, flow is",
      "one ray a pixel: some 0.1 s a frame of 640x480");
  const GelSpec& gel = scene.device.gel;
  const bool clear_and_curved = !gel.slab() && !scene.device.coating;
  if (gel.mesh() || clear_and_curved) {
    fail_at(scene.where,
            "outputs: an image is asked for, but the gel of the device '{}' ({}) is {}; pictures can be had of slabs, "
            "and of domes and fingertips with a coating; truth alone with frames, ideal and radiance all false",
            scene.device.name, scene.device.where.file, gel.mesh() ? "a mesh" : "curved and has no coating");
  }
  const PlateSpec& plate = scene.device.plate;
  const bool refracts = gel.refractive_index != 1.0 || plate.refractive_index != 1.0;
  plan.refraction = table.add("refraction", refracts,
                              refracts ? fmt::format("plate of index {} and gel of index {} stand before the camera",
                                                     plate.refractive_index, gel.refractive_index)
                                       : "no index differs from 1",
                              "closed form at the flat faces: under a tenth of the rays' time");

  plan_print(scene, plan, table);
  plan_interreflection(scene, plan, table);
  plan_bands(scene, plan, table);
  plan_translucent_coating(scene, plan, table);
  if (!scene.device.background.empty()) {
    table.add("background", true,
              "the device has a frame of an untouched unit: pictures show it where nothing is pressed",
              "the untouched device's light once, then nothing");
  }
  if (scene.device.residual) {
    table.add("residual map", true, in_words(*scene.device.residual),
              "a ray a pixel, and two exponentials for each of its centres");
  }
  const bool noise = scene.outputs.frames;
  plan.sensor_noise =
      table.add("sensor noise", scene.effects.sensor_noise, noise,
                noise ? "frames are asked for as the camera delivers them" : "only ideal pictures are asked for",
                "a few milliseconds a frame");
}

}  // namespace

double interreflection_estimate(const GelSpec& gel, const PlateSpec& plate, double albedo, double disc_radius_mm) {
  // A Lambertian disc sends 2 sin cos d(theta) of its light at theta; that part is reflected at the plate's lower face
  // (and little at the face between gel and plate, left out) and comes down moved sideways.
  constexpr int kSteps = 2000;
  double once = 0.0;
  for (int i = 0; i < kSteps; ++i) {
    const double sine = (i + 0.5) / kSteps;
    const double invariant = gel.refractive_index * sine;
    if (invariant >= plate.refractive_index) continue;
    const double plate_sine = invariant / plate.refractive_index;
    const double shift = 2.0 * (gel.thickness_mm * sine / std::sqrt(1.0 - sine * sine) +
                                plate.thickness_mm * plate_sine / std::sqrt(1.0 - plate_sine * plate_sine));
    once +=
        2.0 * sine / kSteps * fresnel(plate.refractive_index, 1.0, plate_sine) * disc_overlap(disc_radius_mm, shift);
  }
  const double gain = albedo * once;
  return gain / (1.0 - gain);
}

double inertia_estimate(const GelSpec& gel, double frequency_Hz) {
  const double lowest = fem::layer_shear_frequency({gel.youngs_modulus_MPa, gel.poisson_ratio},
                                                   gel.density_kg_m3 * kTonnePerMm3, gel.thickness_mm);
  return std::pow(frequency_Hz / lowest, 2);
}

Plan make_plan(const SceneSpec& scene, const SceneNeeds& needs) {
  Plan plan;
  PlanTable table(plan, accuracy_of(scene.accuracy, scene.device.accuracy), needs);
  plan_mechanics(scene, plan, table);
  plan_relief(scene, plan, table);
  plan_light(scene, plan, table);
  if (plan.camera) {
    plan_pipeline(scene, plan, table);
    plan_time(scene, plan, table);
    plan_diffraction(scene, plan, table);
    plan_direct_light(scene, plan, table);
    plan_paths(scene, plan, table);
    plan_shared_paths(scene, plan, table);
  }
  add_warnings(scene, needs, plan);
  return plan;
}

}  // namespace touchstone::sim
