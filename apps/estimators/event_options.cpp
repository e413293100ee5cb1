#include "apps/estimators/event_options.h"

#include "apps/progress_bar.h"
#include "core/error.h"
#include "datasets/sets/csv_cells.h"

namespace touchstone::apps {

std::shared_ptr<EventOptions> add_event_options(CLI::App& command) {
  auto options = std::make_shared<EventOptions>();
  command.add_option("--size", options->size, "The camera's picture in pixels, as 240x180, where files don't say it");
  command.add_option("--stream", options->stream, "Which stream of an AEDAT 4.0 file that has several")
      ->check(CLI::Range(0, 1'000'000));
  return options;
}

sensors::EventReadOptions read_options(const EventOptions& options) {
  sensors::EventReadOptions read;
  if (options.stream >= 0) read.stream = options.stream;
  if (options.size.empty()) return read;
  const std::size_t cross = options.size.find('x');
  const auto width = datasets::number_of<int>(options.size.substr(0, cross));
  const auto height =
      cross == std::string::npos ? std::nullopt : datasets::number_of<int>(options.size.substr(cross + 1));
  constexpr int kMost = 8192;
  if (!width || !height || *width < 1 || *height < 1 || *width > kMost || *height > kMost) {
    fail("--size: '{}' isn't WIDTHxHEIGHT, each from 1 to {}", options.size, kMost);
  }
  read.size = cv::Size(*width, *height);
  return read;
}

lab::SeenGrasps seen_grasps(const std::filesystem::path& table, lab::GraspNeeds needs, const EventOptions& options,
                            const GlobalOptions& global) {
  const auto listed = lab::read_grasp_table(table, needs);
  lab::SeenGrasps grasps;
  {
    ProgressBar bar(global.quiet);
    grasps = lab::read_grasps(listed, read_options(options), bar.listener());
  }
  warn_of_faults(grasps.faults);
  return grasps;
}

}  // namespace touchstone::apps
