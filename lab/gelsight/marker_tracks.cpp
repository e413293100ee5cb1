#include "lab/gelsight/marker_tracks.h"

#include <fmt/format.h>

#include <functional>
#include <limits>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/whole_file.h"
#include "datasets/inspection/on_picture.h"
#include "datasets/sets/csv_cells.h"
#include "sensors/markers/marker_overlay.h"
#include "sim/files/image_file.h"

namespace touchstone::lab {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHeader = "sequence,frame,file,t_us,marker,x_px,y_px,dx_px,dy_px,trusted,status\n";

/// What all lines of a frame begin with.
std::string line_start(const std::string& sequence, const datasets::LabelledFrame& frame, bool times_known) {
  return fmt::format("{},{},{},{},", datasets::csv_cell(sequence), frame.frame,
                     datasets::csv_cell(frame.file.filename().string()),
                     times_known ? fmt::format("{}", frame.t_us) : std::string());
}

void add_markers(const std::string& start, const sensors::TrackedMarkers& markers, std::string& csv) {
  for (std::size_t i = 0; i < markers.rest.size(); ++i) {
    const Eigen::Vector2d& place = markers.positions[i];
    const Eigen::Vector2d moved = markers.displacement(i);
    csv += fmt::format("{}{},{:.4f},{:.4f},{:.4f},{:.4f},{},{}\n", start, i, place.x(), place.y(), moved.x(), moved.y(),
                       markers.trusted(i) ? 1 : 0, sensors::name_of(markers.status[i]));
  }
}

/// A tracker that has seen the gel at rest. @throws Error naming the picture
sensors::MarkerTracker tracker_at_rest(const fs::path& rest) {
  sensors::MarkerTracker tracker({});
  datasets::on_picture(rest, [&](const cv::Mat& image) {
    tracker.track({image, std::numeric_limits<std::int64_t>::min()});  // before any frame, whatever clock they have
  });
  return tracker;
}

/// @param tracker has seen the gel at rest
MarkerTrack follow(const datasets::FrameSequence& sequence, sensors::MarkerTracker tracker,
                   const MarkerTrackSettings& settings, const fs::path& overlays, std::string& csv,
                   const std::function<void()>& frame_done) {
  MarkerTrack track;
  track.sequence = sequence.name;
  track.appearance = tracker.appearance().value();
  track.appearance.spacing_px = tracker.spacing_px();  // measured between centres, where learning is good to pixels
  track.markers = static_cast<int>(tracker.tracked().rest.size());
  cv::Mat picture;
  for (const datasets::LabelledFrame& frame : sequence.frames) {
    const std::string start = line_start(sequence.name, frame, settings.times_known);
    std::string fault = datasets::fault_on_picture(frame.file, [&](const cv::Mat& image) {
      const sensors::TrackedMarkers& markers = tracker.track({image, frame.t_us});
      add_markers(start, markers, csv);
      ++track.frames;
      track.places += static_cast<std::int64_t>(markers.rest.size());
      for (std::size_t i = 0; i < markers.rest.size(); ++i) track.trusted += markers.trusted(i) ? 1 : 0;
      if (markers.jumped && track.jumped_at < 0) track.jumped_at = frame.frame;
      if (settings.overlay) {
        sensors::draw_overlay(image, markers, track.appearance, picture, {.arrow_scale = settings.arrow_scale});
      }
    });
    if (!fault.empty()) {
      csv += fmt::format("{},,,,,0,{}\n", start, datasets::csv_cell(fault));
      track.faults.push_back(std::move(fault));
    } else if (settings.overlay) {
      sim::write_png(overlays / frame.file.filename().replace_extension(".png"), picture);
    }
    frame_done();
  }
  return track;
}

}  // namespace

std::vector<MarkerTrack> write_marker_tracks(const std::vector<datasets::FrameSequence>& sequences,
                                             const MarkerTrackSettings& settings, const fs::path& folder,
                                             const Progress& progress) {
  std::int64_t total = 0, done = 0;
  for (const datasets::FrameSequence& sequence : sequences) total += std::ssize(sequence.frames);
  const auto frame_done = [&] {
    ++done;
    if (progress) progress("markers", done, total);
  };
  // All frames at rest come before anything is written.
  std::vector<std::optional<sensors::MarkerTracker>> at_rest;
  std::vector<std::string> refused;
  for (const datasets::FrameSequence& sequence : sequences) {
    at_rest.emplace_back();
    refused.emplace_back();
    try {
      at_rest.back() = tracker_at_rest(settings.rest.empty() ? sequence.frames.front().file : settings.rest);
    } catch (const Error& error) {
      refused.back() = fmt::format("{} (this is the frame at rest; --rest names another)", error.what());
      if (sequences.size() == 1 || !settings.rest.empty()) fail("{}", refused.back());
    }
  }
  fs::create_directories(folder);
  std::vector<MarkerTrack> tracks;
  std::vector<std::string> faults;
  std::string csv = kHeader;
  for (std::size_t i = 0; i < sequences.size(); ++i) {
    const datasets::FrameSequence& sequence = sequences[i];
    const fs::path overlays = folder / "overlay" / (sequences.size() > 1 ? sequence.name : "");
    if (at_rest[i]) {
      if (settings.overlay) fs::create_directories(overlays);
      tracks.push_back(follow(sequence, std::move(*at_rest[i]), settings, overlays, csv, frame_done));
    } else {
      csv += fmt::format("{},,,,,0,{}\n", line_start(sequence.name, sequence.frames.front(), settings.times_known),
                         datasets::csv_cell(refused[i]));
      MarkerTrack none;
      none.sequence = sequence.name;
      none.faults.push_back(refused[i]);
      tracks.push_back(std::move(none));
      done += std::ssize(sequence.frames);
    }
    const MarkerTrack& track = tracks.back();
    if (track.frames == 0) faults.insert(faults.end(), track.faults.begin(), track.faults.end());
  }
  std::size_t without_frames = 0;
  for (const MarkerTrack& track : tracks) without_frames += track.frames == 0 ? 1U : 0U;
  if (without_frames == tracks.size()) fail("none of {} frames can be used; the first: {}", total, faults.front());
  write_whole_file(folder / "markers.csv", csv);
  return tracks;
}

}  // namespace touchstone::lab
