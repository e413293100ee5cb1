#include <fmt/format.h>

#include <memory>

#include "apps/command.h"
#include "apps/estimators/source_options.h"
#include "apps/progress_bar.h"
#include "lab/vhs/skin_mark_table.h"

namespace touchstone::apps {
namespace {

struct EstimateOptions {
  std::filesystem::path rest, out;
  sensors::SkinMarkSettings marks;
};

void estimate(const EstimateOptions& options, const SourceOptions& source, const GlobalOptions& global) {
  require_writable_place(options.out);
  lab::MarkSummary summary;
  {
    ProgressBar bar(global.quiet);
    summary = lab::write_skin_marks(opened_streams(source), options.rest, options.marks, options.out, bar.listener());
  }
  warn_of_faults(summary.faults);
  warn_of_notes(source);
  fmt::print("{}: marks of {} pictures: {} erythema, {} purpura, {} unknown\n", options.out.string(), summary.pictures,
             summary.erythema, summary.purpura, summary.unknown);
}

}  // namespace

void add_marks_estimation(CLI::App& estimations, const GlobalOptions& global, Action& action) {
  CLI::App* command = estimations.add_subcommand(
      "marks",
      "Marks of skin through a clear gel: those that fade under pressure (erythema) and those that stay (purpura)");
  auto options = std::make_shared<EstimateOptions>();
  sensors::SkinMarkSettings& marks = options->marks;
  const auto source = add_source_options(*command, "--frames", {});
  command->add_option("--rest", options->rest,
                      "The picture before pressure; without it the first frame of each sequence shows it");
  command->add_option("--least-index", marks.least_index, "How much redder than the skin a mark must be")
      ->check(CLI::Range(0.1, 1000.0))
      ->capture_default_str();
  command->add_option("--least-area-px", marks.least_area_px, "How large it must be, px")
      ->check(CLI::Range(1.0, 1e9))
      ->capture_default_str();
  command->add_option("--bead-px", marks.bead_px, "Dark things narrower than this are beads")
      ->check(CLI::Range(2.0, 200.0))
      ->capture_default_str();
  command->add_option("--blanched-share", marks.blanched_share, "From this share of redness lost on it's erythema")
      ->check(CLI::Range(0.01, 1.0))
      ->capture_default_str();
  command
      ->add_option(
          "--wetted-part", marks.wetted_part,
          "A mark that keeps more than this part of its light isn't touched; 0: no check, for a picture before "
          "pressure in which the gel wets the skin already")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  command->add_option("-o,--out", options->out, "The marks: a .csv file, one line a mark of a frame")->required();
  command->callback([&action, options, source, &global] {
    action = [options, source, &global] { estimate(*options, *source, global); };
  });
}

}  // namespace touchstone::apps
