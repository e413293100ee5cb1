#pragma once
// Keypoints with binary descriptors on height images: BRISK [Leutenegger2011] as in [Li2015, sec. 3.3.1], by OpenCV's
// features2d.

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "sensors/touch_map/relief_detail.h"

namespace cv {
class BRISK;
}

namespace touchstone::sensors {

/// 512 bits.
using BinaryDescriptor = std::array<std::uint64_t, 8>;

/// Keypoints of one touch or map, each with its descriptor.
struct HeightFeatures {
  std::vector<Eigen::Vector2d> points;  ///< mm, in the detail's frame
  std::vector<BinaryDescriptor> descriptors;
};

/// How keypoints are found and described.
struct FeatureSettings {
  /// Of the picture in which features are looked for. A pressed membrane is smooth over some tenths of a millimetre,
  /// and the detector looks at rings of 3 px radius: on finer pixels it sees no corners.
  double pitch_mm = 0.06;
  int threshold = 10;  ///< least grey difference of a corner (AGAST)
  /// Of the scale space. 0: touches of one sensor have one scale, and in the octaves OpenCV 4.6 puts keypoints half a
  /// pixel aside, which doesn't turn with the touch (0.05 mm of 0.05 mm pixels, against 0.004 mm without octaves).
  int octaves = 0;
  double pattern_scale = 0.8;        ///< BRISK's sampling pattern, against its authors'
  double grey_range_rms = 3.0;       ///< the detail's rms that the greys from 128 to 255 stand for
  double rms_over_mm = 1.0;          ///< sigma of the neighbourhood that the rms is taken over
  double least_rms_mm = 0.012;       ///< weaker detail isn't made stronger: many times the noise that is left in it
  std::size_t most_features = 4000;  ///< the strongest are kept
};

/// Detail as a grey picture, CV_8UC1: 128 + 127 d / (grey_range_rms * max(rms, least_rms_mm)), clamped, with the rms of
/// each pixel's neighbourhood.
cv::Mat grey_of(const ReliefDetail& detail, const FeatureSettings& settings);

/// Finds features. Made once: BRISK's tables take 50 MB and a tenth of a second.
class HeightFeatureDetector {
 public:
  /// @throws Error for settings out of range
  explicit HeightFeatureDetector(const FeatureSettings& settings = {});

  /// Only keypoints where `detail.weight` is above 0 are kept.
  HeightFeatures detect(const ReliefDetail& detail) const;

 private:
  FeatureSettings settings_;
  std::shared_ptr<cv::BRISK> brisk_;
};

/// Number of bits in which two descriptors differ.
int hamming_distance(const BinaryDescriptor& a, const BinaryDescriptor& b);

/// Two features that look alike.
struct FeatureMatch {
  int from = 0, to = 0;  ///< indices of features
  int distance = 0;      ///< bits
};

/// Which descriptors are taken for the same place.
struct MatchSettings {
  int most_bits = 140;    ///< of 512: the threshold on the Hamming distance
  int most_partners = 8;  ///< of each feature, the nearest first: relief repeats itself, as a plug's corners do
};

/// For each feature of `from` its nearest ones in `to` within the threshold, ordered by (from, distance, to).
std::vector<FeatureMatch> match(const HeightFeatures& from, const HeightFeatures& to, const MatchSettings& settings);

}  // namespace touchstone::sensors
