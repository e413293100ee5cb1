#pragma once
// The membrane's height under an object, with the object's fine relief where the plan calls for it.

#include <memory>
#include <opencv2/core/mat.hpp>
#include <optional>

#include "core/triangle_mesh.h"
#include "fem/fine_relief/fine_relief.h"
#include "sim/plan/plan.h"
#include "sim/scene/scene.h"

namespace touchstone::sim {

/// The membrane of one scene. Made once; its functions are pure and may be called from several threads.
class Membrane {
 public:
  /// @throws Error for a gel whose outer surface is neither flat nor a dome that fem::SmoothSurface takes, or a height
  /// map of more than kMostHeightPixels a side
  Membrane(const SceneSpec& scene, const Plan& plan, const fem::Compliance& gel);
  /// The same with the surface of another scene's membrane on the same gel. @throws Error likewise
  Membrane(const SceneSpec& scene, const Plan& plan, std::shared_ptr<const fem::SmoothSurface> surface);

  /// The fine contact at `press`; nothing where the plan has fine relief off. Never throws for want of contact.
  std::optional<fem::ReliefAnswer> relief(const fem::PressState& press) const;

  /// Height over the undeformed surface along z (of a dome: not over the plane z = 0), mm (CV_32FC1), as a profilometer
  /// above the gel finds it: column i, row j is the place x = (i + 0.5) pixel - width / 2, y = (j + 0.5) pixel - height
  /// / 2 of the gel frame. `relief` as relief() gave it.
  cv::Mat height(const fem::PressState& press, const std::optional<fem::ReliefAnswer>& relief) const;
  double pixel_mm() const { return pixel_; }
  const std::shared_ptr<const fem::SmoothSurface>& surface() const { return surface_; }

  /// The displaced surface as a camera sees it, made as fine as the relief: what is free, and what lies on the object.
  /// Gel frame, mm; together they are one sheet without a crack. @pre the relief has contact
  struct Sheet {
    TriangleMesh dry;
    TriangleMesh wet;
    std::vector<Eigen::Vector3d> rest;  ///< per vertex of either: the same material point on the undeformed gel
  };
  /// As fine as the relief's grid.
  Sheet sheet(const fem::PressState& press, const fem::ReliefAnswer& relief) const;

 private:
  std::shared_ptr<const fem::SmoothSurface> surface_;
  std::optional<fem::ContactShape> shape_;      // with all its detail; only where fine relief is on
  std::optional<fem::ElasticMaterial> object_;  // of an elastic one
  double pixel_, relief_pixel_;
  int columns_, rows_;
};

inline constexpr int kMostHeightPixels = 4096;  ///< along a side of a height map: more are refused

}  // namespace touchstone::sim
