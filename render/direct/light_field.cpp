#include "render/direct/light_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "core/error.h"
#include "render/lamps/lamp_connection.h"
#include "render/scene/flat_faces.h"

namespace touchstone::render {
namespace {

constexpr double kMostNodes = 2.5e6;  // some 5 s on two cores; a light that takes more has an edge in the box

/// The fixture with unit intensity in one band, with the absorption of one band (or none for a negative number).
Scene single_band(const Scene& fixture, int band) {
  Scene scene;
  scene.faces = fixture.faces;
  scene.environment = flat_spectrum(1, 0.0);
  scene.media.clear();
  for (const Medium& medium : fixture.media) {
    Medium one{medium};
    one.absorption = Spectrum{};
    if (band >= 0 && medium.absorption.size() > 0) one.absorption = flat_spectrum(1, medium.absorption[band]);
    scene.media.push_back(one);
  }
  for (Lamp lamp : fixture.lamps) {
    const double unit = emission_integral(lamp);
    std::visit([&](auto& one) { one.power_W = flat_spectrum(1, unit); }, lamp);
    scene.lamps.push_back(lamp);
  }
  return scene;
}

/// F by connections, mean over the lens.
Eigen::Vector3d flow_of_lens(const PreparedScene<1>& scene, const PreparedLamp<1>& lamp, int layer,
                             const Eigen::Vector3d& place, int lens_points) {
  const int side = lamp.area > 0.0 ? lens_points : 1;
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::uint64_t uncounted = 0;
  for (int i = 0; i < side; ++i) {
    for (int j = 0; j < side; ++j) {
      const Receiver particle{place, Eigen::Vector3d::Zero(), layer, scene.medium_of_layer(layer)};
      Arrival<1> arrival;
      const Eigen::Vector3d source = point_on_lamp(lamp, {(i + 0.5) / side, (j + 0.5) / side});
      if (!connect_to_lamp(scene, lamp, source, particle, uncounted, arrival)) continue;
      sum -= arrival.irradiance[0] * arrival.direction;
    }
  }
  return sum / (static_cast<double>(side) * side);
}

struct Maker {
  const LightFieldSettings& settings;
  PreparedScene<1> clear;
  std::vector<std::unique_ptr<PreparedScene<1>>> absorbing;  // by band; none if nothing absorbs
  std::vector<int> group_of;                                 // by number of all beams: that of the field's

  int beams_of(const PreparedLamp<1>& lamp) const {
    return lamp.kind == LampKind::kGuide ? settings.guides.beams() : 1;
  }

  /// Of all beams, lamp by lamp.
  int all_beams() const {
    int count = 0;
    for (const PreparedLamp<1>& lamp : clear.lamps) count += beams_of(lamp);
    return count;
  }
  std::vector<Eigen::Vector3d> all_flows(const PreparedScene<1>& scene, int layer, const Eigen::Vector3d& place) const {
    std::vector<Eigen::Vector3d> flows(all_beams());
    Eigen::Vector3d* to = flows.data();
    for (const PreparedLamp<1>& lamp : scene.lamps) {
      if (lamp.kind == LampKind::kGuide) {
        guide_beam_flows(scene, lamp, settings.guides, layer, place, settings.guide_points, settings.walls, to);
      } else {
        *to = flow_of_lens(scene, lamp, layer, place, settings.lens_points);
      }
      to += beams_of(lamp);
    }
    return flows;
  }

  static Eigen::Vector3d place(const LightField& field, double i, double j, double k) {
    return field.reach.min() + Eigen::Vector3d(i * field.step[0], j * field.step[1], k * field.step[2]);
  }

  /// Which beams the field has: of a guide those that bring little are put together with the one beside them, and as
  /// many as it takes.
  void choose_beams(LightField& field) {
    constexpr double kLittle = 0.03;  // of the guide's light, wherever in the box
    const int all = all_beams();
    std::vector<int> lamp_of;
    std::vector<int> run_of;  // beams that may be put together
    for (std::size_t lamp = 0; lamp < clear.lamps.size(); ++lamp) {
      for (int k = 0; k < beams_of(clear.lamps[lamp]); ++k) {
        lamp_of.push_back(static_cast<int>(lamp));
        const bool joins = k % settings.guides.beams_a_sector() != 0;
        run_of.push_back(run_of.empty() ? 0 : run_of.back() + (joins ? 0 : 1));
      }
    }
    std::vector<double> share(all, 0.0);  // the most of the lamp's light at one of 27 places
    for (int number = 0; number < 27; ++number) {
      const Eigen::Array3d at(number % 3, number / 3 % 3, number / 9);
      const Eigen::Vector3d where = field.reach.min() + (0.5 * at * field.reach.sizes().array()).matrix();
      const std::vector<Eigen::Vector3d> flows = all_flows(clear, field.layer, where);
      std::vector<double> whole(clear.lamps.size(), 0.0);
      for (int k = 0; k < all; ++k) whole[lamp_of[k]] += flows[k].norm();
      for (int k = 0; k < all; ++k) {
        if (whole[lamp_of[k]] > 0.0) share[k] = std::max(share[k], flows[k].norm() / whole[lamp_of[k]]);
      }
    }
    struct Group {
      int first, end;  // numbers of beams
      double share;
    };
    std::vector<Group> groups;
    for (int k = 0; k < all; ++k) groups.push_back({k, k + 1, share[k]});
    for (;;) {
      std::size_t least = 0;
      double least_share = INFINITY;
      for (std::size_t g = 0; g + 1 < groups.size(); ++g) {
        if (run_of[groups[g].first] != run_of[groups[g + 1].first]) continue;
        const double weaker = std::min(groups[g].share, groups[g + 1].share);
        if (weaker < least_share) {
          least_share = weaker;
          least = g;
        }
      }
      const bool too_many = groups.size() > static_cast<std::size_t>(settings.most_beams);
      if (!(least_share < (too_many ? INFINITY : kLittle / settings.guides.sectors))) break;
      groups[least].end = groups[least + 1].end;
      groups[least].share += groups[least + 1].share;
      groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(least) + 1);
    }
    group_of.assign(all, 0);
    for (std::size_t g = 0; g < groups.size(); ++g) {
      std::fill(group_of.begin() + groups[g].first, group_of.begin() + groups[g].end, static_cast<int>(g));
    }
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const int lamp = lamp_of[groups[g].first];
      field.lamp_of.push_back(lamp);
      const Lamp& one = field.fixture.lamps[lamp];
      field.intensity.push_back(lamp_power(one) / emission_integral(one));
      if (!std::holds_alternative<GuideLamp>(one)) {
        field.beside.emplace_back();
        continue;
      }
      const int sector = settings.guides.beams_a_sector();
      const int middle = (groups[g].first + groups[g].end - 1) / 2;
      const auto group_at = [&](int number, bool same_run) {
        const bool fits =
            number >= 0 && number < all && lamp_of[number] == lamp && (run_of[number] == run_of[middle]) == same_run;
        return fits ? group_of[number] : -1;
      };
      field.beside.push_back({group_at(groups[g].first - 1, true), group_at(groups[g].end, true),
                              group_at(middle - sector, false), group_at(middle + sector, false)});
    }
  }

  /// Of the field's beams.
  std::vector<Eigen::Vector3d> flows(const PreparedScene<1>& scene, const LightField& field,
                                     const Eigen::Vector3d& place) const {
    std::vector<Eigen::Vector3d> sums(field.beam_count(), Eigen::Vector3d::Zero());
    const std::vector<Eigen::Vector3d> all = all_flows(scene, field.layer, place);
    for (std::size_t k = 0; k < all.size(); ++k) sums[group_of[k]] += all[k];
    return sums;
  }

  /// `halved`: the axis whose cells are half as long as those of the grid that `field` holds, whose nodes are kept:
  /// they are every other one of the new grid, at the same places to the bit. -1 for none.
  void fill(LightField& field, int halved) const {
    const int beams = field.beam_count();
    const int across = field.nodes[0] * field.nodes[1];
    const auto bands = static_cast<int>(absorbing.size());
    const auto count = static_cast<std::size_t>(across) * field.nodes[2] * beams;
    const std::vector<float> known_flow = std::exchange(field.flow, std::vector<float>(4 * count));
    const std::vector<float> known_pass = std::exchange(field.pass, std::vector<float>(bands * count));
    tbb::parallel_for(0, across * field.nodes[2], [&](int node) {
      const int in_plane = node % across;
      Eigen::Array3i index(in_plane % field.nodes[0], in_plane / field.nodes[0], node / across);
      const std::size_t first = static_cast<std::size_t>(node) * beams;
      if (halved >= 0 && index[halved] % 2 == 0) {
        Eigen::Array3i nodes = field.nodes;
        nodes[halved] = field.nodes[halved] / 2 + 1;
        index[halved] /= 2;
        const int before = index[0] + nodes[0] * (index[1] + nodes[1] * index[2]);
        const std::size_t from = static_cast<std::size_t>(before) * beams;
        std::copy_n(known_flow.begin() + 4 * from, 4 * beams, field.flow.begin() + 4 * first);
        std::copy_n(known_pass.begin() + bands * from, bands * beams, field.pass.begin() + bands * first);
        return;
      }
      const Eigen::Vector3d at = place(field, index[0], index[1], index[2]);
      const std::vector<Eigen::Vector3d> whole = flows(clear, field, at);
      for (int beam = 0; beam < beams; ++beam) {
        const Eigen::Vector3d& flow = whole[beam];
        float* out = field.flow.data() + 4 * (first + beam);
        for (int a = 0; a < 3; ++a) out[a] = static_cast<float>(flow[a]);
        out[3] = static_cast<float>(flow.norm());
      }
      for (int band = 0; band < bands; ++band) {
        const std::vector<Eigen::Vector3d> dimmed = flows(*absorbing[band], field, at);
        for (int beam = 0; beam < beams; ++beam) {
          const double length = whole[beam].norm();
          field.pass[bands * (first + beam) + band] =
              static_cast<float>(length > 0.0 ? dimmed[beam].norm() / length : 0.0);
        }
      }
    });
  }

  /// Every cell of a small grid; of a large one some 1000 that are spread evenly: their root mean square is known to
  /// some percent, and looking at all would take longer than the nodes.
  struct LookedAt {
    Eigen::Array3i cells;
    int stride, count;
    LookedAt(const LightField& field, const Eigen::Array3d& offset)
        : cells(field.nodes - (offset > 0.0).cast<int>()),
          stride(std::max(1, cells.prod() / 1000) | 1),
          count((cells.prod() + stride - 1) / stride) {}
  };

  /// Relative error at points set off from nodes by `offset` steps.
  double error(const LightField& field, const Eigen::Array3d& offset) const {
    const int beams = field.beam_count();
    const LookedAt looked_at(field, offset);
    const Eigen::Array3i& cells = looked_at.cells;
    std::vector<std::array<double, 2>> squares(looked_at.count, {0.0, 0.0});
    const double lit_radius =
        settings.lit_radius > 0.0 ? settings.lit_radius + 0.5 * std::hypot(field.step[0], field.step[1]) : INFINITY;
    tbb::parallel_for(0, looked_at.count, [&](int number) {
      const int cell = number * looked_at.stride;
      const Eigen::Vector3d at = place(field, cell % cells[0] + offset[0], cell / cells[0] % cells[1] + offset[1],
                                       cell / (cells[0] * cells[1]) + offset[2]);
      if (at.head<2>().norm() > lit_radius) return;
      std::vector<float> held(4 * static_cast<std::size_t>(beams));
      look_up_flow(field, find_cell(field, float(at.x()), float(at.y()), float(at.z())), held.data());
      const std::vector<Eigen::Vector3d> exact = flows(clear, field, at);
      double wrong = 0.0;
      double whole = 0.0;
      for (int beam = 0; beam < beams;) {
        const int lamp = field.lamp_of[beam];
        const double power = field.intensity[beam].sum();
        Eigen::Vector3d off = Eigen::Vector3d::Zero();
        Eigen::Vector3d light = Eigen::Vector3d::Zero();
        for (; beam < beams && field.lamp_of[beam] == lamp; ++beam) {
          const float* f = held.data() + 4 * beam;
          off += Eigen::Vector3d(f[0], f[1], f[2]) - exact[beam];
          light += exact[beam];
        }
        wrong += power * off.norm();
        whole += power * light.norm();
      }
      squares[number] = {wrong * wrong, whole * whole};
    });
    double wrong = 0.0;
    double whole = 0.0;
    for (const auto& [w, t] : squares) {
      wrong += w;
      whole += t;
    }
    return whole > 0.0 ? std::sqrt(wrong / whole) : 0.0;
  }
  /// Errors along each axis.
  Eigen::Array3d axis_errors(const LightField& field) const {
    Eigen::Array3d errors;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Array3d offset = Eigen::Array3d::Zero();
      offset[axis] = 0.5;
      errors[axis] = error(field, offset);
    }
    return errors;
  }
};

void check_settings(const LightFieldSettings& settings) {
  if (!(settings.accuracy > 0.0 && settings.accuracy <= 1.0)) {
    fail("light field: accuracy is {}; it must be above 0 and at most 1", settings.accuracy);
  }
  if (!(settings.lit_radius >= 0.0)) {
    fail("light field: lit_radius is {} mm; it must be 0 or more", settings.lit_radius);
  }
  if (settings.lens_points < 1 || settings.lens_points > 64) {
    fail("light field: lens_points is {}; it must be from 1 to 64", settings.lens_points);
  }
  if (settings.guides.sectors < 1 || settings.guides.slices < 1 || settings.guides.beams() > 1000) {
    fail("light field: guides are cut into {} sectors of {} slices; 1 or more, and 1000 beams at most, are allowed",
         settings.guides.sectors, settings.guides.slices);
  }
  if (settings.most_beams < 1) fail("light field: most_beams is {}; it must be 1 or more", settings.most_beams);
  if (settings.guide_points < 1 || settings.guide_points > 16) {
    fail("light field: guide_points is {}; it must be from 1 to 16", settings.guide_points);
  }
  if (settings.most_flows < 8 || settings.most_flows > 500000000) {
    fail("light field: most_flows is {}; it must be from 8 to 500000000", settings.most_flows);
  }
}

/// In the plate a guide's light has edges where its mirror images meet.
void check_guide(const GuideLamp& guide, const Scene& fixture, const Eigen::AlignedBox3d& reach, std::size_t number) {
  if (layer_of_height(fixture.faces, guide.centre.z()) != layer_of_height(fixture.faces, reach.center().z())) return;
  fail("light field: lamp {} is a light guide in the box's own layer; its light has edges there that no grid holds",
       number);
}

Eigen::Vector3d nearest_in(const Eigen::AlignedBox3d& box, const Eigen::Vector3d& place) {
  return place.cwiseMax(box.min()).cwiseMin(box.max());
}

/// How far a lamp's body stays from the box, mm; 0 or less where it may reach into it. Of a luminous rectangle, whose
/// strip may lie close beside a wide box, by going to and fro between the two, which converges for convex bodies; of
/// others by the sphere about them.
double clearance(const Lamp& lamp, const Eigen::AlignedBox3d& box) {
  const auto* area = std::get_if<AreaLamp>(&lamp);
  if (area == nullptr) return box.exteriorDistance(lamp_position(lamp)) - lamp_extent(lamp);
  constexpr int kMostSteps = 1000;
  constexpr double kTouching = 1e-3;  // mm; converging slowly where they touch, steps end above 0
  const auto [across, up] = sides_of(*area);
  Eigen::Vector3d place = area->centre;
  for (int step = 0; step < kMostSteps; ++step) {
    const Eigen::Vector3d from_centre = nearest_in(box, place) - area->centre;
    const Eigen::Vector3d next = area->centre +
                                 std::clamp(from_centre.dot(across), -0.5 * area->width, 0.5 * area->width) * across +
                                 std::clamp(from_centre.dot(up), -0.5 * area->height, 0.5 * area->height) * up;
    const bool settled = (next - place).norm() < 1e-9;
    place = next;
    if (settled) break;
  }
  return (place - nearest_in(box, place)).norm() - kTouching;
}

void check_reach(const Scene& fixture, const Eigen::AlignedBox3d& reach) {
  const Eigen::Vector3d size = reach.sizes();
  if (!reach.min().allFinite() || !reach.max().allFinite() || !(size.minCoeff() > 1e-6) || size.maxCoeff() > 1e5) {
    fail("light field: the box from ({}, {}, {}) to ({}, {}, {}) mm; each side must be 1e-6 to 1e5 mm long",
         reach.min().x(), reach.min().y(), reach.min().z(), reach.max().x(), reach.max().y(), reach.max().z());
  }
  for (std::size_t i = 0; i < fixture.faces.size(); ++i) {
    const double z = fixture.faces[i].z;
    if (z > reach.min().z() && z < reach.max().z()) {
      fail("light field: face {} at z {} cuts the box, z {} to {}; it must lie between faces", i, z, reach.min().z(),
           reach.max().z());
    }
  }
  for (std::size_t i = 0; i < fixture.lamps.size(); ++i) {
    if (const auto* guide = std::get_if<GuideLamp>(&fixture.lamps[i])) {
      check_guide(*guide, fixture, reach, i);
      continue;
    }
    if (is_visible(fixture.lamps[i])) fail("light field: lamp {} is visible; such lamps are for the path tracer", i);
    const Eigen::Vector3d& middle = lamp_position(fixture.lamps[i]);
    if (clearance(fixture.lamps[i], reach) <= 0.0) {
      fail("light field: lamp {} at ({}, {}, {}) reaches into the box; the field is endless there", i, middle.x(),
           middle.y(), middle.z());
    }
  }
}

}  // namespace

UprightWalls walls_round_sheet(const Scene& rest, const Eigen::AlignedBox3d& reach) {
  constexpr double kRim_mm = 0.05;  // a sheet's rim may stand out so far, as that of a round one does from its facets
  if (rest.surfaces.size() != 2 || !rest.balls.empty() || rest.lamps.empty()) return {};
  const double middle = reach.center().z();
  const bool lamps_below = lamp_position(rest.lamps.front()).z() < middle;
  const auto above = std::ranges::find_if(rest.faces, [&](const FlatFace& face) { return face.z > middle; });
  if (above == (lamps_below ? rest.faces.begin() : rest.faces.end())) return {};
  UprightWalls walls(rest.surfaces[1].mesh, lamps_below ? std::prev(above)->z : above->z);
  if (walls.empty()) return {};
  bool hide = false;
  for (const Lamp& lamp : rest.lamps) {
    const Eigen::Vector3d& place = lamp_position(lamp);
    const bool outside = walls.beyond(place.head<2>()) > kRim_mm;
    if ((place.z() < middle) != lamps_below || (outside && !std::holds_alternative<GuideLamp>(lamp))) return {};
    hide = hide || outside;
  }
  const bool within = std::ranges::all_of(rest.surfaces[0].mesh.vertices, [&](const Eigen::Vector3d& vertex) {
    return walls.beyond(vertex.head<2>()) <= kRim_mm;
  });
  return hide && within ? walls : UprightWalls{};
}

namespace {

/// A field without its grid: box, layer and walls, once they are found sound.
LightField field_over(const Scene& fixture, const Eigen::AlignedBox3d& reach, const LightFieldSettings& settings) {
  LightField field;
  field.fixture = fixture;
  field.fixture.surfaces.clear();
  field.fixture.balls.clear();
  check_scene(field.fixture);
  check_settings(settings);
  if (fixture.lamps.empty()) fail("light field: the scene has no lamps; without them there is no field");
  check_reach(fixture, reach);
  field.reach = reach;
  field.walls = settings.walls;
  // By the box's middle, since it may end just on a face.
  const double middle = reach.center().z();
  for (const FlatFace& face : fixture.faces) field.layer += face.z < middle ? 1 : 0;
  return field;
}

/// That with its beams, what fills it, and the cells to begin with: about as long as wide, some eight along the longest
/// side.
struct BegunField {
  LightField field;
  Maker maker;
  Eigen::Array3i cells;

  BegunField(const Scene& fixture, const Eigen::AlignedBox3d& reach, const LightFieldSettings& settings)
      : field(field_over(fixture, reach, settings)),
        maker{settings, PreparedScene<1>(single_band(fixture, -1)), {}, {}},
        cells((reach.sizes().array() / (reach.sizes().maxCoeff() / 8.0)).ceil().cast<int>().max(1)) {
    field.index = maker.clear.media[maker.clear.medium_of_layer(field.layer)].index;
    const bool absorbs = std::any_of(fixture.media.begin(), fixture.media.end(), [](const Medium& medium) {
      return medium.absorption.size() > 0 && (medium.absorption > 0.0).any();
    });
    if (absorbs) {
      for (int band = 0; band < fixture.environment.size(); ++band) {
        maker.absorbing.push_back(std::make_unique<PreparedScene<1>>(single_band(fixture, band)));
      }
    }
    maker.choose_beams(field);
  }
};

/// Puts a grid of `cells` over the field's box. @returns its nodes, or nothing where they are too many
std::optional<double> take_grid(const Eigen::Array3i& cells, const LightFieldSettings& settings, LightField& field) {
  field.nodes = cells + 1;
  field.step = field.reach.sizes().array() / cells.cast<double>();
  const double nodes = field.nodes.cast<double>().prod();
  if (nodes > kMostNodes || nodes * field.beam_count() > settings.most_flows) return std::nullopt;
  return nodes;
}

/// The first of the largest.
int worst_axis(const Eigen::Array3d& errors) {
  int worst = 0;
  for (int axis = 1; axis < 3; ++axis) worst = errors[axis] > errors[worst] ? axis : worst;
  return worst;
}

}  // namespace

LightField make_light_field(const Scene& fixture, const Eigen::AlignedBox3d& reach,
                            const LightFieldSettings& settings) {
  BegunField begun(fixture, reach, settings);
  LightField& field = begun.field;
  const Maker& maker = begun.maker;
  Eigen::Array3i& cells = begun.cells;
  for (int halved = -1;;) {
    if (!take_grid(cells, settings, field)) {
      fail(
          "light field: accuracy {} needs {} nodes or more of {} beams; {} nodes and {} of both are allowed (the last "
          "grid's error is {:.2g}; a lobe's rim that crosses the box needs a wider soft_angle)",
          settings.accuracy, field.nodes.cast<double>().prod(), field.beam_count(), kMostNodes, settings.most_flows,
          field.error);
    }
    maker.fill(field, halved);
    field.error = maker.error(field, Eigen::Array3d::Constant(0.5));
    if (field.error <= settings.accuracy) return std::move(field);
    halved = worst_axis(maker.axis_errors(field));
    cells[halved] *= 2;
  }
}

LightFieldCount count_light_field(const Scene& fixture, const Eigen::AlignedBox3d& reach,
                                  const LightFieldSettings& settings) {
  constexpr double kMostFilled = 12000.0;
  BegunField begun(fixture, reach, settings);
  LightField& field = begun.field;
  const Maker& maker = begun.maker;
  const double a_node = 1.0 + static_cast<double>(maker.absorbing.size());
  LightFieldCount count;
  double known = 0.0;
  Eigen::Array3d along = Eigen::Array3d::Zero();
  double together = 1.0;  // the error in the cells' middles over the sum of those along the axes
  for (int halved = -1;;) {
    const std::optional<double> nodes = take_grid(begun.cells, settings, field);
    if (!nodes) return count;
    double work = a_node * (*nodes - known) + Maker::LookedAt(field, Eigen::Array3d::Constant(0.5)).count;
    for (int axis = 0; axis < 3; ++axis)
      work += Maker::LookedAt(field, 0.5 * Eigen::Vector3d::Unit(axis).array()).count;
    count.places += work;
    known = *nodes;
    if (known <= kMostFilled) {
      maker.fill(field, halved);
      field.error = maker.error(field, Eigen::Array3d::Constant(0.5));
      along = maker.axis_errors(field);
      together = field.error / std::max(1e-300, along.sum());
      count.looked_at += work;
    } else {
      along[halved] *= 0.25;  // of second order in the step
      field.error = together * along.sum();
    }
    count.fits = field.error <= settings.accuracy;
    if (count.fits) return count;
    halved = worst_axis(along);
    begun.cells[halved] *= 2;
  }
}

Eigen::Vector4d exact_flow(const LightField& field, int lamp, const Eigen::Vector3d& place,
                           const LightFieldSettings& settings) {
  TS_ASSERT(lamp >= 0 && lamp < static_cast<int>(field.fixture.lamps.size()));
  const Maker maker{settings, PreparedScene<1>(single_band(field.fixture, -1)), {}, {}};
  const std::vector<Eigen::Vector3d> flows = maker.all_flows(maker.clear, field.layer, place);
  std::size_t first = 0;
  for (int before = 0; before < lamp; ++before) first += maker.beams_of(maker.clear.lamps[before]);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < maker.beams_of(maker.clear.lamps[lamp]); ++k) sum += flows[first + k];
  return {sum.x(), sum.y(), sum.z(), sum.norm()};
}

}  // namespace touchstone::render
