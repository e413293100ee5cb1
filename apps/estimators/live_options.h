#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <opencv2/core/mat.hpp>
#include <string>

#include "apps/command.h"
#include "apps/live_view.h"

namespace touchstone::apps {

/// Whether and where an estimate is shown while it runs.
struct LiveOptions {
  bool on = false;
  int port = 0;  ///< 0: any free one
};

/// Adds --live [PORT].
std::shared_ptr<LiveOptions> add_live_options(CLI::App& command);

/// Opens the view and says where it is; null if it isn't asked for. @throws Error as LiveView
std::unique_ptr<LiveView> opened_view(const LiveOptions& options, const std::string& title);

/// What shows a picture in the view; empty without one.
std::function<void(const cv::Mat&)> shown_in(LiveView* view);

}  // namespace touchstone::apps
