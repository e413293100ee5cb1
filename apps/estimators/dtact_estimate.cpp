#include <algorithm>
#include <memory>

#include "apps/command.h"
#include "apps/estimators/overlay_sink.h"
#include "apps/estimators/source_options.h"
#include "apps/progress_bar.h"
#include "lab/dtact/darkness_maps.h"
#include "sensors/heights/darkness_model_file.h"
#include "sensors/heights/height_overlay.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path model;
  std::filesystem::path out;
  std::string format = "exr";
  bool doubt = false;
  bool overlay = false;
};

void estimate(const EstimateOptions& options, const SourceOptions& source, const PictureOptions& pictures,
              const GlobalOptions& global) {
  const sensors::DarknessModel model = sensors::load_darkness_model(options.model);
  const lab::HeightFormat format = options.format == "exr" ? lab::HeightFormat::exr : lab::HeightFormat::png16;
  OverlaySink sink(pictures, options.overlay ? options.out / "overlay" : "", "heights of " + source.choice.place);
  lab::ShownDarkness show;
  if (sink.wanted()) {
    show = [&sink, picture = cv::Mat()](const datasets::SourceFrame& frame,
                                        const sensors::DarknessResult& result) mutable {
      sensors::draw_overlay(frame.image, result, lab::kWhite_mm, picture);
      sink.take(frame, picture);
    };
  }
  ProgressBar bar(global.quiet);
  const std::vector<lab::DarknessRecord> records =
      lab::write_darkness_maps(model, opened_streams(source), options.out, format, options.doubt, bar.listener(), show);
  sink.finish();
  const std::vector<std::string> faults = lab::faults_of(records);
  warn_of_faults(faults);
  warn_of_notes(source);
  const auto count = [&](auto fault) { return std::count_if(records.begin(), records.end(), fault); };
  const auto untrusted =
      count([](const lab::DarknessRecord& record) { return !record.trusted && record.fault.empty(); });
  const auto deeper = count([](const lab::DarknessRecord& record) { return record.deeper_percent > 0.0; });
  const auto at_border = count([](const lab::DarknessRecord& record) { return record.contact_at_border; });
  const auto unfollowed =
      count([](const lab::DarknessRecord& record) { return !record.exposure_followed && record.fault.empty(); });
  fmt::print("{}: {} height maps and heights.csv\n", options.out.string(), records.size() - faults.size());
  if (untrusted > 0) fmt::print("  {} of them of frames that are overexposed or dark: not to be trusted\n", untrusted);
  if (deeper > 0) fmt::print("  {} with places that are darker than any press of the calibration\n", deeper);
  if (at_border > 0) fmt::print("  {} with a contact that runs out of the picture\n", at_border);
  if (model.darkening.follow_exposure && unfollowed > 0) {
    fmt::print("  {} whose border shows no one exposure: taken as at rest\n", unfollowed);
  }
}

}  // namespace

void add_9dtact_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand("9dtact", "Height maps from its frames");
  auto options = std::make_shared<EstimateOptions>();
  command->add_option("--model", options->model, "The model that `touchstone calibrate 9dtact` made")->required();
  const auto source = add_source_options(*command, "--frames", {});
  command->add_option("-o,--out", options->out, "The folder of the height maps and their summary, heights.csv")
      ->required();
  command
      ->add_option("--format", options->format,
                   "'exr': floats in mm; 'png16': 16 bit, 0.1 um a level, level 10000 is 0 mm")
      ->check(CLI::IsMember({"exr", "png16"}))
      ->capture_default_str();
  command->add_flag(
      "--doubt", options->doubt,
      "Also write FRAME-doubt.png: a pixel adds 1 if saturated, 2 if unlit, 4 if darker and 8 if brighter "
      "than calibrated");
  command->add_flag("--overlay", options->overlay,
                    "Pictures of the frames with the contact's outline, beside their heights (white: 1 mm), too");
  const auto pictures = add_picture_options(*command);
  command->callback([&action, options, source, pictures, &global] {
    action = [options, source, pictures, &global] { estimate(*options, *source, *pictures, global); };
  });
}

}  // namespace touchstone::apps
