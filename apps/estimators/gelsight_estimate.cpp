#include <algorithm>
#include <functional>
#include <memory>

#include "apps/command.h"
#include "apps/estimators/overlay_sink.h"
#include "apps/estimators/source_options.h"
#include "apps/progress_bar.h"
#include "core/error.h"
#include "datasets/sources/any_source.h"
#include "lab/gelsight/height_maps.h"
#include "sensors/heights/height_model_file.h"
#include "sensors/heights/height_overlay.h"

namespace touchstone::apps {
namespace {

constexpr std::int64_t kMostRest = 64;  // frames that a background is the mean of

struct EstimateOptions {
  std::filesystem::path model;
  std::filesystem::path out;
  std::string rest;
  double follow = 0.0;
  std::string border = "zero";
  std::string format = "exr";
  bool overlay = false;
};

/// Frames of the gel at rest in the place of the calibration's background.
void take_rest(const std::string& place, sensors::HeightModel& model) {
  if (datasets::is_live(place)) fail("--rest: {} is live; recorded frames of the gel at rest are needed", place);
  datasets::SourceChoice choice;
  choice.place = place;
  choice.most_frames = kMostRest;
  std::vector<cv::Mat> frames;
  datasets::for_each_frame(datasets::streams_of(choice), [&](const datasets::SourceFrame& frame) {
    if (!frame.fault.empty()) fail("--rest: {}", frame.fault);
    const std::string fault = sensors::frame_fault(frame.image, model.background.mean.size());
    if (!fault.empty()) fail("--rest: {} {}", frame.title, fault);
    frames.push_back(frame.image);
  });
  model.background = sensors::mean_background(frames);
}

void estimate(const EstimateOptions& options, const SourceOptions& source, const PictureOptions& pictures,
              const GlobalOptions& global) {
  sensors::HeightModel model = sensors::load_height_model(options.model);
  if (!options.rest.empty()) take_rest(options.rest, model);
  sensors::HeightSettings settings;
  settings.follow.frames = options.follow;
  if (options.border == "free") settings.border = sensors::HeightBorder::free;
  const lab::HeightFormat format = options.format == "exr" ? lab::HeightFormat::exr : lab::HeightFormat::png16;
  OverlaySink sink(pictures, options.overlay ? options.out / "overlay" : "", "heights of " + source.choice.place);
  std::function<void(const datasets::SourceFrame&, const sensors::HeightResult&)> show;
  if (sink.wanted()) {
    show = [&sink, picture = cv::Mat()](const datasets::SourceFrame& frame,
                                        const sensors::HeightResult& result) mutable {
      sensors::draw_overlay(frame.image, result, lab::kWhite_mm, picture);
      sink.take(frame, picture);
    };
  }
  ProgressBar bar(global.quiet);
  const std::vector<lab::HeightRecord> records =
      lab::write_height_maps(model, settings, opened_streams(source), options.out, format, bar.listener(), show);
  const std::vector<std::string> faults = lab::faults_of(records);
  sink.finish();
  warn_of_faults(faults);
  warn_of_notes(source);
  const auto count = [&](auto fault) { return std::count_if(records.begin(), records.end(), fault); };
  const auto untrusted = count([](const lab::HeightRecord& record) { return !record.trusted && record.fault.empty(); });
  const auto at_border = count([](const lab::HeightRecord& record) { return record.contact_at_border; });
  fmt::print("{}: {} height maps and heights.csv\n", options.out.string(), records.size() - faults.size());
  if (untrusted > 0) {
    fmt::print(
        "  {} of them of frames that are overexposed, dark, of one colour or nowhere like the gel at rest: not to "
        "be trusted\n",
        untrusted);
  }
  if (at_border > 0) {
    fmt::print("  {} with a contact that runs out of the picture{}\n", at_border,
               settings.border == sensors::HeightBorder::zero ? ": --border free suits them" : "");
  }
}

}  // namespace

void add_gelsight_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand("gelsight", "Height maps from its frames");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("--model", options->model, "The model that `touchstone calibrate gelsight` made")->required();
  const auto source = add_source_options(*command, "--frames", {});
  command->add_option("-o,--out", options->out, "The folder of the height maps and their summary, heights.csv")
      ->required();
  command->add_option("--rest", options->rest,
                      "Frames of the gel at rest, in place of the calibration's: a folder, a video or one picture, of "
                      "which the first 64 count");
  command
      ->add_option("--follow", options->follow,
                   "Follow light that drifts, where nothing touches, to 63 % within so many frames; 0: not")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
  command
      ->add_option("--border", options->border,
                   "Height at the picture's border: 'zero', or 'free' where contacts run out of the picture")
      ->check(CLI::IsMember({"zero", "free"}))
      ->capture_default_str();
  command
      ->add_option("--format", options->format,
                   "'exr': floats in mm; 'png16': 16 bit, 0.1 um a level, level 10000 is 0 mm")
      ->check(CLI::IsMember({"exr", "png16"}))
      ->capture_default_str();
  command->add_flag("--overlay", options->overlay,
                    "Pictures of the frames with the contact's outline, beside their heights (white: 1 mm), too");
  const auto pictures = add_picture_options(*command);
  command->callback([&action, options, source, pictures, &global] {
    action = [options, source, pictures, &global] { estimate(*options, *source, *pictures, global); };
  });
}

}  // namespace touchstone::apps
