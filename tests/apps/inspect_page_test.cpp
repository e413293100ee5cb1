#include <cstdlib>
#include <regex>

#include "core/whole_file.h"
#include "tests/apps/run_program.h"
#include "tests/support/small_draw.h"
#include "tests/support/small_job.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

using test::expect_refused;
using test::ProgramRun;
using test::run_program;
using test::run_words;
using test::TemporaryFolder;
using ::testing::HasSubstr;
using ::testing::Not;

/// A small set and its page, made once.
class InspectPage : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = new TemporaryFolder;
    test::write_small_job(*folder_);
    folder_->write("scene.yaml",
                   "device: device.yaml\nobject: object.yaml\nmotion: motion.yaml\n"
                   "light: {min_samples: 4, max_samples: 8}\noutputs: {frames: true, contact: true}\n");
    const ProgramRun made =
        run_program({"--quiet", "--cache", path("cache"), "generate", path("job.yaml"), "-o", path("set")});
    ASSERT_EQ(made.exit_code, 0) << made.err;
    const ProgramRun page = run_program({"inspect", path("set"), "-o", path("page.html"), "--job", path("job.yaml")});
    ASSERT_EQ(page.exit_code, 0) << page.err;
    html_ = new std::string(read_whole_file(path("page.html")));
  }
  static void TearDownTestSuite() {
    // For who wants to see it.
    if (const char* keep = std::getenv("TOUCHSTONE_KEEP_PAGE")) write_whole_file(keep, *html_);
    delete html_;
    delete folder_;
  }
  /// Runs chromium on a page of `folder`, its profile and picture there: its document on standard output.
  static ProgramRun browse(const std::filesystem::path& folder, const std::string& page) {
    return run_words(
        {"/bin/sh", "-c",
         "HOME=\"$1\" timeout 900 chromium --headless --no-sandbox --disable-dev-shm-usage --use-angle=swiftshader "
         "--enable-unsafe-swiftshader --enable-logging=stderr --user-data-dir=\"$1/profile\" "
         "--window-size=800,600 --virtual-time-budget=20000 --screenshot=\"$1/page.png\" --dump-dom "
         "\"file://$1/$2\"",
         "sh", folder.string(), page});
  }
  static bool has_browser() { return run_words({"/bin/sh", "-c", "command -v chromium"}).exit_code == 0; }

  static std::string path(const std::string& name) { return (folder_->path() / name).string(); }
  static int count(const std::string& text) {
    int found = 0;
    for (std::size_t at = 0; (at = html_->find(text, at)) != std::string::npos; at += text.size()) ++found;
    return found;
  }

  static TemporaryFolder* folder_;
  static std::string* html_;
};
TemporaryFolder* InspectPage::folder_ = nullptr;
std::string* InspectPage::html_ = nullptr;

TEST_F(InspectPage, HoldsPicturesPlotsAndReasons) {
  EXPECT_EQ(count("<img "), 3) << "the sheet, and one picture with its truth a scene";
  EXPECT_EQ(count("src=\"data:image/jpeg;base64,/9j/"), 3);
  EXPECT_EQ(count("<svg "), 1 + 12 + 3) << "forces over time, histograms, error bars";
  for (const char* part :
       {"<h1>small-job</h1>", ">force z</text>", ">object&#39;s x</text>", "<h2>Error bars</h2>",
        "<td>friction</td><td>on</td>", "<h3>middle, beside</h3>", "<td>/wrench</td>", "scenes:\n  - {name: middle"}) {
    EXPECT_NE(html_->find(part), std::string::npos) << part;  // without printing the page
  }
  EXPECT_EQ(count("Less is drawn"), 0) << "the job is known";
}

TEST_F(InspectPage, NeedsNothingElse) {
  const std::regex outside("(src|href)=\"(?!data:)");
  EXPECT_FALSE(std::regex_search(html_->substr(0, html_->find("<script")), outside));
  const std::size_t end = html_->rfind("</script>");
  if (end != std::string::npos) {
    EXPECT_FALSE(std::regex_search(html_->substr(end), outside));
  }
  EXPECT_EQ(count("<script src"), 0);
}

TEST_F(InspectPage, IsTheSameForTheSameSet) {
  ASSERT_EQ(run_program({"inspect", path("set"), "-o", path("again.html"), "--job", path("job.yaml")}).exit_code, 0);
  EXPECT_EQ(read_whole_file(path("again.html")), *html_);
}

TEST_F(InspectPage, DoesWithoutTheJobAndSaysSo) {
  const ProgramRun run = run_program({"inspect", path("set"), "-o", path("no-job.html")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("12 samples in 2 scenes; the job's file isn't known (--job names it)"));
  EXPECT_THAT(read_whole_file(path("no-job.html")), HasSubstr("Less is drawn: the job&#39;s file"));
}

/// A drawn set has sensors instead of scenes, and carries their devices.
TEST_F(InspectPage, ShowsDrawnSets) {
  const TemporaryFolder folder;
  const std::string job = test::write_small_draw(folder).string();
  const auto at = [&](const std::string& name) { return (folder.path() / name).string(); };
  const ProgramRun made = run_program({"--quiet", "--cache", at("cache"), "generate", job, "-o", at("set")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  const ProgramRun run = run_program({"inspect", at("set"), "-o", at("page.html")});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.out, at("page.html") + ": 10 samples in 2 units\n");
  const std::string page = read_whole_file(at("page.html"));
  if (const char* keep = std::getenv("TOUCHSTONE_KEEP_DRAWN_PAGE")) write_whole_file(keep, page);
  const auto times = [&](const std::string& text) {
    int found = 0;
    for (std::size_t k = 0; (k = page.find(text, k)) != std::string::npos; k += text.size()) ++found;
    return found;
  };
  EXPECT_EQ(times("src=\"data:image/jpeg;base64,/9j/"), 3) << "the sheet, and one picture with its truth a sensor";
  EXPECT_EQ(times("<svg "), 12 + 2) << "histograms, error bars";
  for (const char* part : {"<h1>small-draw</h1>", "<td>unit 1</td>", "<td>gel.youngs_modulus_MPa</td>", "train 5",
                           "test 5", "<td>/drawn/force_N</td>", "small-coated", "unit 0, sample "}) {
    EXPECT_NE(page.find(part), std::string::npos) << part;
  }
  EXPECT_EQ(times("Less is drawn"), 0);
  EXPECT_EQ(times("id=\"model\""), html_->find("id=\"model\"") == std::string::npos ? 0 : 1);
  EXPECT_EQ(run_program({"inspect", at("set"), "-o", at("sheet.png")}).exit_code, 0);
  expect_refused(run_program({"inspect", at("set"), "-o", at("page.html"), "--job", job}), "--job: isn't for a set");
  std::filesystem::resize_file(folder.path() / "set/blocks/000001.h5", 3000);
  expect_refused(run_program({"inspect", at("set"), "-o", at("page.html")}), "was changed");
}

TEST_F(InspectPage, RefusesWhatIsNotTheSetsOwn) {
  TemporaryFolder other;
  test::write_small_job(other);
  other.write("motion.yaml", "start_mm: [0, 0, 2.2]\nkeys:\n  - {frames: 5, z: {position_mm: 1.8}}\n");
  expect_refused(
      run_program({"inspect", path("set"), "-o", path("x.html"), "--job", (other.path() / "job.yaml").string()}),
      "what the job names isn't that this set was made of");
  expect_refused(run_program({"inspect", path("cache"), "-o", path("x.html")}), "isn't a data set");
  expect_refused(run_program({"inspect", path("set"), "-o", path("x.pdf")}), "must end in .html or .png");
  expect_refused(run_program({"inspect", path("set"), "-o", path("x.png"), "--job", path("job.yaml")}),
                 "--job: is for a page");
  expect_refused(run_program({"inspect", path("set"), "-o", path("nowhere/x.html")}), "nowhere");
}

TEST_F(InspectPage, ShowsInABrowserWithoutErrors) {
  if (html_->find("id=\"model\"") == std::string::npos) GTEST_SKIP() << "built without three.js";
  if (!has_browser()) GTEST_SKIP() << "there is no chromium";
  const ProgramRun run = browse(folder_->path(), "page.html");
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("data-ready=\"yes\"")) << "the model was read and drawn";
  EXPECT_THAT(run.err, Not(HasSubstr("CONSOLE"))) << "the page has said something";
}

// A drawn set's sensors may differ in many numbers.
TEST_F(InspectPage, IsNoWiderThanItsWindow) {
  if (!has_browser()) GTEST_SKIP() << "there is no chromium";
  const TemporaryFolder folder;
  std::string draw = test::kSmallDraw;
  draw.replace(draw.find("power_W'"), 8, "power_W[*]'");
  const std::string job = test::write_small_draw(folder, draw).string();
  const auto at = [&](const std::string& name) { return (folder.path() / name).string(); };
  const ProgramRun made = run_program({"--quiet", "--cache", at("cache"), "generate", job, "-o", at("set")});
  ASSERT_EQ(made.exit_code, 0) << made.err;
  ASSERT_EQ(run_program({"inspect", at("set"), "-o", at("page.html")}).exit_code, 0);
  for (const auto& [page, where] :
       {std::pair(path("page.html"), folder_->path()), std::pair(at("page.html"), folder.path())}) {
    std::string html = read_whole_file(page);
    const std::string end = "</body>";
    html.replace(html.rfind(end), end.size(),
                 "<script>document.body.setAttribute('data-beyond', document.documentElement.scrollWidth - "
                 "document.documentElement.clientWidth);</script></body>");
    write_whole_file(where / "measured.html", html);
    const ProgramRun run = browse(where, "measured.html");
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const std::size_t found = run.out.find("data-beyond=\"");
    ASSERT_NE(found, std::string::npos);
    EXPECT_EQ(run.out.substr(found, 15), "data-beyond=\"0\"") << page;
  }
}

}  // namespace
}  // namespace touchstone
