#pragma once
// truth.h5: what is true at each sample. See docs/file-formats.md for its arrays.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/hdf5_file.h"
#include "datasets/jobs/job.h"
#include "datasets/jobs/split.h"
#include "fem/elements/compliance.h"
#include "sim/press/truth.h"

namespace touchstone::datasets {

/// What is the same for all samples of a truth file.
struct TruthHeader {
  std::string job_name;
  std::string version;                     ///< of the program
  std::int64_t samples = 0;                ///< N
  std::int64_t objects = 1;                ///< K, in every scene
  std::vector<std::string> scenes;         ///< names, in the job's order
  std::vector<Eigen::Vector3d> bead_rest;  ///< m centres without load, gel frame, mm
};

/// One array of the truth file.
struct ArrayShape {
  std::string path;
  std::string unit;
  std::string axes;  ///< "samples x 6"
  std::vector<std::int64_t> shape;
};

/// Writes a truth file sample by sample, in order. The same samples give the same bytes.
class TruthFileWriter {
 public:
  /// @throws Error if the file can't be made
  TruthFileWriter(const std::filesystem::path& file, const TruthHeader& header, const fem::Compliance& gel);
  ~TruthFileWriter();
  TruthFileWriter(const TruthFileWriter&) = delete;
  TruthFileWriter& operator=(const TruthFileWriter&) = delete;

  /// The next sample, which is frame `truth.frame` of scene number `scene`.
  void append(int scene, Split split, const sim::Truth& truth);
  /// Ends the file. @pre as many samples were appended as the header says
  void close();
  /// All arrays of the file.
  const std::vector<ArrayShape>& arrays() const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// The columns that estimators are trained on and judged by.
struct TruthTable {
  std::vector<std::string> scene_names;
  std::vector<std::int64_t> t_us;
  std::vector<int> scene;
  std::vector<Split> split;
  std::vector<int> frame;
  std::vector<Eigen::Matrix<double, 6, 1>> wrench;  ///< on the object: N, N mm, gel frame

  std::int64_t samples() const { return static_cast<std::int64_t>(t_us.size()); }
};

/// @throws Error if the file isn't a truth file, or is broken
TruthTable read_truth_table(const std::filesystem::path& file);
/// The same of a file that is open, for use within read_hdf5. Errors name `path`.
TruthTable truth_table_in(const Hdf5Reader& file, const std::filesystem::path& path);

}  // namespace touchstone::datasets
