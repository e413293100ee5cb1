#include "apps/estimators/source_options.h"

#include <signal.h>

#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <utility>

#include "core/error.h"

namespace touchstone::apps {
namespace {

std::atomic<bool> stop_asked{false};

void ask_to_stop(int) {
  stop_asked = true;
}

/// The first Ctrl-C (or a service's end) only notes it; the next one ends the program as usual.
void stop_frames_by_signal() {
  struct sigaction action {};
  action.sa_handler = &ask_to_stop;
  action.sa_flags = static_cast<int>(SA_RESETHAND);
  for (const int signal : {SIGINT, SIGTERM}) ::sigaction(signal, &action, nullptr);
}

}  // namespace

std::shared_ptr<SourceOptions> add_source_options(CLI::App& command, const std::string& name, const SourceNeeds& needs,
                                                  bool required) {
  auto options = std::make_shared<SourceOptions>();
  options->split = needs.split;
  datasets::SourceChoice& choice = options->choice;
  command.add_option(name, choice.place, datasets::kSourceHelp)->required(required);
  command
      .add_option_function<std::string>(
          "--split",
          [options](const std::string& split) {
            options->split = split;
            options->choice.split_given = true;
          },
          "Of a data set: train, validate, test or all")
      ->default_str(needs.split);
  command.add_option("--times", choice.times,
                     "When recorded frames were taken: CSV with the header file,t_us or file,t_s (pictures), or "
                     "frame,t_us or frame,t_s, frames counted from 0");
  if (needs.forces) {
    command.add_option("--forces", choice.forces,
                       "Times and forces of recorded frames, on the object, x to the picture's right, y down: CSV with "
                       "the header file,t_us,force_x_N,force_y_N,force_z_N; of a video frame,... in place of file,...");
  }
  command
      .add_option("--rate,--frame-rate", choice.rate_Hz, "Frames a second, in place of the times that a recording has")
      ->check(CLI::Range(1e-3, 1e6));
  command.add_option("--count", choice.most_frames, "End after so many frames")
      ->check(CLI::Range(std::int64_t{1}, std::int64_t{1} << 40));
  command.add_option("--seconds", choice.most_s, "End this long after the first frame")->check(CLI::Range(1e-3, 1e9));
  command
      .add_option("--timeout", choice.timeout_s, "How long to wait for a camera or an address, and for each frame, s")
      ->check(CLI::Range(0.1, 3600.0))
      ->capture_default_str();
  return options;
}

std::vector<datasets::FrameStream> opened_streams(const SourceOptions& options) {
  datasets::SourceChoice choice = options.choice;
  if (options.split != "all") choice.split = datasets::split_named(options.split);
  if (datasets::is_live(choice.place)) {
    stop_frames_by_signal();
    choice.stopped = [] { return stop_asked.load(); };
  }
  std::vector<datasets::FrameStream> streams = datasets::streams_of(choice);
  for (datasets::FrameStream& stream : streams) stream = datasets::watched(std::move(stream), options.notes);
  return streams;
}

void require_times(const datasets::FrameStream& stream) {
  if (stream.live) return;
  const std::unique_ptr<datasets::FrameSource> source = stream.open();
  datasets::SourceFrame frame;
  if (!source->next(frame) || !frame.fault.empty() || frame.label.timed) return;
  fail("{}: when its frames were taken isn't known; --rate HZ, --times CSV or --forces CSV says it", stream.name);
}

void warn_of_notes(const SourceOptions& options) {
  constexpr std::size_t kMostNamed = 5;
  const auto some_of = [&](const std::vector<std::string>& notes, const char* between) {
    const std::vector<std::string> some(notes.begin(), notes.begin() + std::min(notes.size(), kMostNamed));
    return fmt::format("{}{}", fmt::join(some, between), notes.size() > kMostNamed ? ", and so on" : "");
  };
  const auto& [doubled, gaps] = *options.notes;
  if (!doubled.empty()) {
    spdlog::warn("{} frame{} the very picture of the one before, as when a recorder doubles it: {}", doubled.size(),
                 doubled.size() == 1 ? " has" : "s have", some_of(doubled, ", "));
  }
  if (!gaps.empty()) spdlog::warn("frames were dropped at {} places: {}", gaps.size(), some_of(gaps, "; "));
}

std::string name_of_source(const SourceOptions& options) {
  std::string place = options.choice.place;
  while (place.size() > 1 && place.back() == '/') place.pop_back();
  return std::filesystem::path(place).filename().string();
}

}  // namespace touchstone::apps
