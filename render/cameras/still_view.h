#pragma once
// First hits of a camera before which a sheet moves and all else stands still.

#include <Eigen/Geometry>
#include <vector>

#include "render/cameras/first_hits.h"

namespace touchstone::render {

/// What each pixel's ray does up to the sheet, kept from frame to frame: where it comes into the sheet's layer, and
/// what it meets of all that stands still.
class StillView {
 public:
  /// Of `scene` all but the first surface, the sheet, stands still. The sheet lies in one layer of the faces, that of
  /// its highest point, in every frame. @throws Error as check_scene
  StillView(const Scene& scene, const ReadyCamera& camera);

  /// What first_hits says of the scene with this first surface.
  std::vector<FirstHit> first_hits(const Surface& sheet) const;

 private:
  struct Ray {
    Eigen::Vector3d origin, direction;  ///< in the sheet's layer
    double far = -1.0;                  ///< to what stands still or to the next face; negative: it doesn't get there
    FirstHit still;
  };
  std::vector<Ray> rays_;
};

}  // namespace touchstone::render
