#pragma once

#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>

#include "apps/live_view.h"

namespace touchstone::apps {

/// Where the pictures of an estimate go: to files, to a live view, to both or to neither.
class OverlaySink {
 public:
  /// @param folder of the pictures, made at the first one; empty: none are kept @param view null: none is shown
  OverlaySink(std::filesystem::path folder, LiveView* view);

  bool wanted() const { return view_ != nullptr || !folder_.empty(); }
  /// Takes a frame's picture. @param stem its name without ending, with a folder where there are several sequences
  void take(const std::string& stem, const cv::Mat& picture) const;

 private:
  std::filesystem::path folder_;
  LiveView* view_;
};

}  // namespace touchstone::apps
