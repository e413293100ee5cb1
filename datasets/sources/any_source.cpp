#include "datasets/sources/any_source.h"

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/named_file.h"
#include "datasets/sets/csv_cells.h"
#include "datasets/sets/manifest.h"
#include "datasets/sources/drawn_frames.h"
#include "datasets/sources/frame_times.h"
#include "datasets/sources/video_frames.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;

constexpr int kMostCameras = 64;

/// A camera's number, if the text is one and nothing on disk has that name.
std::optional<int> camera_of(const std::string& place) {
  constexpr std::string_view kDevice = "/dev/video";
  std::error_code ignored;
  std::string digits = place;
  if (place.starts_with(kDevice)) {
    digits = place.substr(kDevice.size());
  } else if (fs::exists(place, ignored)) {
    return std::nullopt;
  }
  if (digits.empty() || !std::ranges::all_of(digits, [](unsigned char c) { return std::isdigit(c); })) {
    return std::nullopt;
  }
  const auto number = number_of<int>(digits);
  if (!number || *number >= kMostCameras)
    fail("camera {}: there are cameras 0 to {} at most", digits, kMostCameras - 1);
  return number;
}

bool is_data_set(const fs::path& place) {
  std::error_code ignored;
  return fs::exists(place / "dataset.json", ignored);
}

/// Pictures with their times.
FrameStream stream_of_pictures(FrameSequence sequence, const SourceChoice& choice) {
  if (!choice.times.empty()) sequence = with_times(std::move(sequence), read_frame_times(choice.times));
  return picture_stream(std::move(sequence));
}

FrameStream stream_with_tables(FrameStream stream, const SourceChoice& choice) {
  if (!choice.times.empty()) stream = with_times(std::move(stream), read_frame_times(choice.times));
  if (!choice.forces.empty()) {
    stream = with_forces(std::move(stream), read_numbered_forces(choice.forces), choice.forces);
  }
  return stream;
}

std::vector<FrameStream> streams_of_set(const SourceChoice& choice) {
  const fs::path folder = choice.place;
  if (!choice.forces.empty()) fail("--forces: the data set {} has its own", folder.string());
  if (!choice.times.empty()) fail("--times: the data set {} has its own", folder.string());
  if (read_manifest(folder).source == SetSource::draw) return drawn_streams(folder, choice.split);
  return picture_streams(frames_of_data_set(folder, choice.split));
}

FrameStream live_stream_of(const SourceChoice& choice) {
  for (const fs::path& table : {choice.times, choice.forces}) {
    if (!table.empty()) {
      fail("{}: is for what is recorded; {} is live, and its frames have the time at which they come", table.string(),
           choice.place);
    }
  }
  if (choice.rate_Hz > 0.0) fail("--rate: {} is live, and its frames have the time at which they come", choice.place);
  const LivePatience patience{choice.timeout_s, choice.stopped};
  if (const auto number = camera_of(choice.place)) return camera_stream(*number, patience);
  return address_stream(choice.place, patience);
}

std::vector<FrameStream> recorded_streams(const SourceChoice& choice) {
  const fs::path place = choice.place;
  std::error_code failed;
  const fs::file_status status = fs::status(place, failed);
  if (!fs::exists(status)) {
    fail(
        "{}: there is no such folder or file; frames come from a folder of pictures, a data set, a video file, a "
        "camera's number or an address (http://, https://, rtsp://)",
        place.string());
  }
  if (is_data_set(place)) return streams_of_set(choice);
  if (choice.split_given) fail("--split: {} is no data set", place.string());
  if (fs::is_directory(status)) {
    if (!choice.forces.empty()) {
      if (!choice.times.empty()) fail("--times: the times are those of {}", choice.forces.string());
      return {picture_stream(frames_of_force_table(place, choice.forces))};
    }
    return {stream_of_pictures(frames_of_folder(place), choice)};
  }
  if (const std::string fault = fault_of_file(place); !fault.empty()) fail("{}", fault);
  if (is_picture_name(place)) {
    if (!choice.forces.empty()) fail("--forces: {} is one picture; a folder of them is needed", place.string());
    FrameSequence one;
    one.name = place.stem().string();
    LabelledFrame frame;
    frame.file = place;
    frame.timed = false;
    one.frames.push_back(std::move(frame));
    return {stream_of_pictures(std::move(one), choice)};
  }
  if (!choice.forces.empty() && !choice.times.empty())
    fail("--times: the times are those of {}", choice.forces.string());
  return {stream_with_tables(video_stream(choice.place), choice)};
}

}  // namespace

bool is_live(const std::string& place) {
  return camera_of(place).has_value() || is_address(place);
}

std::vector<FrameStream> streams_of(const SourceChoice& choice) {
  const auto need = [](double value, bool zero, const char* what) {
    if (std::isfinite(value) && (value > 0.0 || (zero && value == 0.0))) return;
    fail("{}: {} isn't allowed; it must be above 0", what, value);
  };
  need(choice.rate_Hz, true, "rate");
  need(choice.most_s, true, "seconds");
  need(choice.timeout_s, false, "timeout");
  if (choice.rate_Hz > 0.0 && !choice.times.empty()) fail("--rate: the times are those of {}", choice.times.string());
  if (choice.rate_Hz > 0.0 && !choice.forces.empty()) fail("--rate: the times are those of {}", choice.forces.string());
  const bool live = is_live(choice.place);
  if (live && choice.split_given) fail("--split: {} is no data set", choice.place);
  std::vector<FrameStream> streams;
  if (live) {
    streams.push_back(live_stream_of(choice));
  } else {
    streams = recorded_streams(choice);
  }
  for (FrameStream& stream : streams) {
    if (choice.rate_Hz > 0.0) stream = with_rate(std::move(stream), choice.rate_Hz);
    stream = limited(std::move(stream), choice.most_frames, choice.most_s, live ? choice.stopped : nullptr);
  }
  return streams;
}

}  // namespace touchstone::datasets
