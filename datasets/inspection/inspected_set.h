#pragma once
// A finished data set as a person wants to look at it. All that inspection reads of a set's files is read here.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>
#include <utility>
#include <vector>

#include "core/hdf5_file.h"
#include "core/transform.h"
#include "datasets/sets/manifest.h"
#include "sim/plan/plan.h"
#include "sim/scene/device.h"

namespace touchstone::datasets {

/// A scene, or a sensor of a drawn set.
struct InspectedScene {
  std::string name;
  std::string split;           ///< "train"; of a drawn set how many of each
  std::string device, object;  ///< of a drawn set all objects that were pressed on it
  std::int64_t first_sample = 0;
  std::int64_t samples = 0;
  std::vector<std::string> outputs;                         ///< those that it has
  std::vector<sim::Effect> plan;                            ///< each effect, on or off, and why
  std::vector<std::pair<std::string, std::int64_t>> light;  ///< how its pictures are lit, and how many
  std::vector<std::pair<std::string, double>>
      drawn;  ///< of a drawn set: what distinguishes this sensor from the others
  std::shared_ptr<const sim::DeviceSpec> device_spec;  ///< of a drawn set, null if it can't be read back
};

/// One sample with its truth, as the set's files give it.
struct InspectedSample {
  int scene = 0;
  int frame = 0;
  std::int64_t t_us = 0;
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();  ///< on the object: N, N mm, gel frame
  RigidTransform gel_from_object;
  Eigen::Vector3d force_error = Eigen::Vector3d::Zero();  ///< N, one standard error
  double displacement_error = 0.0;                        ///< mm
  double contact_area = 0.0;                              ///< mm^2
  double largest_strain = 0.0;
  bool under_resolved = false;
};

/// A set of scenes or a drawn one, with all of its samples' truth but without pictures: they are read when they are
/// shown.
struct InspectedSet {
  std::filesystem::path folder;
  bool drawn = false;                 ///< by a job that draws (datasets/inspection/inspected_draw.h)
  std::vector<ManifestBlock> blocks;  ///< of a drawn set
  std::string job_name, job_file, job_text;
  std::string job_sha256, inputs_sha256, content_sha256;
  std::string version, processor;
  std::vector<InspectedScene> scenes;
  std::vector<InspectedSample> samples;
  std::vector<std::array<std::string, 3>> arrays;       ///< path, axes with extents, unit
  std::vector<std::pair<std::string, double>> timings;  ///< stage, seconds; none where the set was made without
  std::int64_t files = 0;
  std::int64_t bytes = 0;

  /// "square-left 12".
  std::string name_of_sample(std::size_t sample) const;
};

/// Of either kind of set. @throws Error if the folder isn't a finished data set, or is damaged
InspectedSet read_inspected_set(const std::filesystem::path& folder);

/// The columns that files of both kinds of sets have, in samples of which all else is still to be filled in.
/// @throws Error naming `path` if a column hasn't `count` rows
std::vector<InspectedSample> read_sample_columns(const Hdf5Reader& file, const std::filesystem::path& path,
                                                 const std::string& force_error, std::size_t count);

/// A sample's picture with the imager's noise, or where the set has only that the one without, grey or BGR; empty if it
/// has neither. @throws Error if it can't be read
cv::Mat inspected_frame(const InspectedSet& set, std::size_t sample);
/// 255 where what a pixel sees is in contact; empty if the set doesn't say.
cv::Mat inspected_contact(const InspectedSet& set, std::size_t sample);

/// The gel's outer surface and beads at one sample, gel frame, mm.
struct InspectedGel {
  std::vector<Eigen::Vector3d> rest;          ///< n vertices
  std::vector<std::array<int, 3>> triangles;  ///< over them
  std::vector<Eigen::Vector3d> displaced;     ///< where they are
  std::vector<bool> contact;                  ///< whether they touch
  std::vector<Eigen::Vector3d> beads;         ///< where the beads' centres are
};

/// @throws Error as read_inspected_set
InspectedGel read_inspected_gel(const InspectedSet& set, std::size_t sample);

}  // namespace touchstone::datasets
