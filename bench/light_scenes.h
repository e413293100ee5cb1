#pragma once
// What bench_light draws: a dented membrane on gel and glass, lit from the camera's side.

#include <functional>

#include "core/transform.h"
#include "core/triangle_mesh.h"
#include "render/cameras/pinhole_camera.h"
#include "render/direct/light_field.h"
#include "render/scene/scene.h"

namespace touchstone::bench {

inline constexpr double kBenchHalf = 10.0;  // mm, of the membrane; the camera sees 8.8

/// z = height(x, y) over the square of kBenchHalf to each side, `cells` x `cells` squares of two triangles.
TriangleMesh height_field(int cells, const std::function<double(double x, double y)>& height);

/// Glass of 2 mm under 5 mm of gel; `lamps` low on a ring of 30 mm, 12 mm below the membrane, of 0.5 W in each band.
/// The membrane has about `triangles` triangles and an imprint of 0.8 mm with a smaller one beside it, moved by `shift`
/// mm; nine beads stand before it. Beads and imprints cast shadows.
render::Scene bench_scene(int triangles, int lamps, int bands, bool interreflection, double shift = 0.0);

/// All that the membrane of bench_scene may reach.
Eigen::AlignedBox3d bench_reach();

/// The vhs camera's place and hole with other pixels on the same sensor.
render::PinholeCamera bench_camera(int width, int height);

}  // namespace touchstone::bench
