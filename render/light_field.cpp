#include "render/light_field.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/error.h"
#include "render/lamp_connection.h"

namespace touchstone::render {
namespace {

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

/// F by connections, mean over the lens, and its length.
Eigen::Vector4d flow_at(const PreparedScene<1>& scene, int number, int layer, const Eigen::Vector3d& place,
                        int lens_points) {
  const PreparedLamp<1>& lamp = scene.lamps[number];
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
  sum /= static_cast<double>(side) * side;
  return {sum.x(), sum.y(), sum.z(), sum.norm()};
}

struct Maker {
  const LightFieldSettings& settings;
  PreparedScene<1> clear;
  std::vector<std::unique_ptr<PreparedScene<1>>> absorbing;  // by band; none if nothing absorbs

  Eigen::Vector3d place(const LightField& field, double i, double j, double k) const {
    return field.reach.min() + Eigen::Vector3d(i * field.step[0], j * field.step[1], k * field.step[2]);
  }

  void fill(LightField& field) const {
    const int lamps = field.lamp_count();
    const int across = field.nodes[0] * field.nodes[1];
    const int bands = static_cast<int>(absorbing.size());
    const auto count = static_cast<std::size_t>(across) * field.nodes[2] * lamps;
    field.flow.assign(4 * count, 0.0f);
    field.pass.assign(bands * count, 0.0f);
    tbb::parallel_for(0, across * field.nodes[2], [&](int node) {
      const int in_plane = node % across;
      const Eigen::Vector3d at = place(field, in_plane % field.nodes[0], in_plane / field.nodes[0], node / across);
      for (int lamp = 0; lamp < lamps; ++lamp) {
        const auto slot = static_cast<std::size_t>(node) * lamps + lamp;
        const Eigen::Vector4d flow = flow_at(clear, lamp, field.layer, at, settings.lens_points);
        for (int a = 0; a < 4; ++a) field.flow[4 * slot + a] = static_cast<float>(flow[a]);
        for (int band = 0; band < bands; ++band) {
          const Eigen::Vector4d dimmed = flow_at(*absorbing[band], lamp, field.layer, at, settings.lens_points);
          field.pass[bands * slot + band] = static_cast<float>(flow[3] > 0.0 ? dimmed[3] / flow[3] : 0.0);
        }
      }
    });
  }

  /// Relative error at points set off from nodes by `offset` steps.
  double error(const LightField& field, const Eigen::Array3d& offset) const {
    const int lamps = field.lamp_count();
    const Eigen::Array3i cells = field.nodes - (offset > 0.0).cast<int>();
    // Every cell of a small grid; of a large one some 4000 that are spread evenly.
    const int all = cells.prod();
    const int stride = std::max(1, all / 4000) | 1;
    const int looked_at = (all + stride - 1) / stride;
    std::vector<std::array<double, 2>> squares(looked_at);
    tbb::parallel_for(0, looked_at, [&](int number) {
      const int cell = number * stride;
      const Eigen::Vector3d at = place(field, cell % cells[0] + offset[0], cell / cells[0] % cells[1] + offset[1],
                                       cell / (cells[0] * cells[1]) + offset[2]);
      std::vector<float> held(4 * static_cast<std::size_t>(lamps));
      look_up_flow(field, find_cell(field, float(at.x()), float(at.y()), float(at.z())), held.data());
      double wrong = 0.0;
      double whole = 0.0;
      for (int lamp = 0; lamp < lamps; ++lamp) {
        const double power = field.intensity[lamp].sum();
        const Eigen::Vector4d exact = flow_at(clear, lamp, field.layer, at, settings.lens_points);
        const float* f = held.data() + 4 * lamp;
        wrong += power * (Eigen::Vector3d(f[0], f[1], f[2]) - exact.head<3>()).norm();
        whole += power * exact[3];
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
};

void check_settings(const LightFieldSettings& settings) {
  if (!(settings.accuracy > 0.0 && settings.accuracy <= 1.0)) {
    fail("light field: accuracy is {}; it must be above 0 and at most 1", settings.accuracy);
  }
  if (settings.lens_points < 1 || settings.lens_points > 64) {
    fail("light field: lens_points is {}; it must be from 1 to 64", settings.lens_points);
  }
  if (settings.most_nodes < 8 || settings.most_nodes > 10000000) {
    fail("light field: most_nodes is {}; it must be from 8 to 10000000", settings.most_nodes);
  }
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
    if (std::holds_alternative<GuideLamp>(fixture.lamps[i])) {
      fail("light field: lamp {} is a light guide, whose light has edges that no coarse grid holds", i);
    }
    if (is_visible(fixture.lamps[i])) fail("light field: lamp {} is visible; such lamps are for the path tracer", i);
    const Eigen::Vector3d& middle = lamp_position(fixture.lamps[i]);
    if (reach.exteriorDistance(middle) <= lamp_extent(fixture.lamps[i])) {
      fail("light field: lamp {} at ({}, {}, {}) reaches into the box; the field is endless there", i, middle.x(),
           middle.y(), middle.z());
    }
  }
}

}  // namespace

LightField make_light_field(const Scene& fixture, const Eigen::AlignedBox3d& reach,
                            const LightFieldSettings& settings) {
  LightField field;
  field.fixture = fixture;
  field.fixture.surfaces.clear();
  field.fixture.balls.clear();
  check_scene(field.fixture);
  check_settings(settings);
  if (fixture.lamps.empty()) fail("light field: the scene has no lamps; without them there is no field");
  check_reach(fixture, reach);
  field.reach = reach;
  // By the box's middle, since it may end just on a face.
  const double middle = reach.center().z();
  for (const FlatFace& face : fixture.faces) field.layer += face.z < middle ? 1 : 0;
  for (const Lamp& lamp : fixture.lamps) field.intensity.push_back(lamp_power(lamp) / emission_integral(lamp));

  Maker maker{settings, PreparedScene<1>(single_band(fixture, -1)), {}};
  field.index = maker.clear.media[maker.clear.medium_of_layer(field.layer)].index;
  const bool absorbs = std::any_of(fixture.media.begin(), fixture.media.end(), [](const Medium& medium) {
    return medium.absorption.size() > 0 && (medium.absorption > 0.0).any();
  });
  if (absorbs) {
    for (int band = 0; band < fixture.environment.size(); ++band) {
      maker.absorbing.push_back(std::make_unique<PreparedScene<1>>(single_band(fixture, band)));
    }
  }

  // Cells about as long as wide to begin with, some eight along the longest side.
  const Eigen::Array3d size = reach.sizes().array();
  Eigen::Array3i cells = (size / (size.maxCoeff() / 8.0)).ceil().cast<int>().max(1);
  for (;;) {
    field.nodes = cells + 1;
    field.step = size / cells.cast<double>();
    if (field.nodes.cast<double>().prod() > settings.most_nodes) {
      fail(
          "light field: accuracy {} needs {} nodes or more, most_nodes is {} (the last grid's error is {:.2g}; a "
          "lobe's "
          "rim that crosses the box needs a wider soft_angle)",
          settings.accuracy, field.nodes.prod(), settings.most_nodes, field.error);
    }
    maker.fill(field);
    field.error = maker.error(field, Eigen::Array3d::Constant(0.5));
    if (field.error <= settings.accuracy) return field;
    int worst = 0;
    double most = -1.0;
    for (int axis = 0; axis < 3; ++axis) {
      Eigen::Array3d offset = Eigen::Array3d::Zero();
      offset[axis] = 0.5;
      const double error = maker.error(field, offset);
      if (error > most) {
        most = error;
        worst = axis;
      }
    }
    cells[worst] *= 2;
  }
}

Eigen::Vector4d exact_flow(const LightField& field, int lamp, const Eigen::Vector3d& place, int lens_points) {
  TS_ASSERT(lamp >= 0 && lamp < field.lamp_count() && lens_points > 0);
  const PreparedScene<1> scene(single_band(field.fixture, -1));
  return flow_at(scene, lamp, field.layer, place, lens_points);
}

}  // namespace touchstone::render
