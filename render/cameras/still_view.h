#pragma once
// First hits of a camera before which a sheet moves and all else stands still.

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "render/cameras/first_hits.h"
#include "render/scene/sheet_index.h"

namespace touchstone::render {

/// What each pixel's ray does up to the sheet, kept from frame to frame: where it comes into the sheet's layer, and
/// what it meets of all that stands still.
class StillView {
 public:
  /// Of `scene` all but the first surface, the sheet, stands still. The sheet lies in one layer of the faces, that of
  /// its highest point, in every frame. @throws Error as check_scene
  StillView(const Scene& scene, const ReadyCamera& camera);

  /// What first_hits says of the scene with this first surface. `known`, if it isn't empty, names for each pixel the
  /// triangle of the sheet that its ray meets first, as it was found with the same ray in less precision; -1 where that
  /// isn't known. A triangle that the ray passes by more than that explains is searched for anew.
  std::vector<FirstHit> first_hits(const Surface& sheet, std::span<const std::int32_t> known = {}) const;

 private:
  struct Ray {
    Eigen::Vector3d origin, direction;  ///< in the sheet's layer
    double far = -1.0;                  ///< to what stands still or to the next face; negative: it doesn't get there
    FirstHit still;
  };
  std::vector<Ray> rays_;

  static FirstHit hit_of(const Ray& ray, const SheetHit& hit, const Surface& sheet);
  Eigen::AlignedBox2d seen_of(const Surface& sheet) const;
};

}  // namespace touchstone::render
