// Reports of estimates, from tables whose errors are known.

#include "datasets/inspection/estimate_page.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "core/error.h"
#include "datasets/inspection/estimate_quantities.h"
#include "sim/files/image_file.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::datasets {
namespace {

namespace fs = std::filesystem;
using test::message_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class EstimatePage : public ::testing::Test {
 protected:
  EstimateTable table(const std::string& text) {
    return read_estimate_table(folder_.write(fmt::format("t{}.csv", count_++), text));
  }
  std::string page(const std::string& text) { return estimate_page("estimates", {table(text)}, {}); }

  test::TemporaryFolder folder_;
  int count_ = 0;
};

TEST_F(EstimatePage, ErrorsAreThoseOfTrustedFramesWithATruth) {
  // z is off by 0.3, -0.3, 0.1 and -0.1: root mean square sqrt(0.05) = 0.2236; half of it within two times 0.1. The
  // frame that isn't trusted is off by 90, the last one has no truth.
  const std::string html = page(
      "sequence,frame,t_us,force_z_N,sigma_force_z_N,true_z_N,trusted\n"
      "a,0,0,1.3,0.1,1,1\na,1,40000,1.7,0.1,2,1\na,2,80000,0.1,0.1,0,1\na,3,120000,2.9,0.1,3,1\n"
      "a,4,160000,90,0.1,0,0\na,5,200000,4,0.1,,1\n");
  EXPECT_THAT(html, AllOf(HasSubstr("How far off"), HasSubstr(">0.2236<"), HasSubstr(">0.3<"), HasSubstr("0 to 3"),
                          HasSubstr("50 %"), HasSubstr("time, s"), HasSubstr("7.5 %"), HasSubstr("stroke-dasharray")));
  EXPECT_THAT(html, AllOf(HasSubstr("Frames not to be trusted"), HasSubstr("1 of 6"), HasSubstr("<td>a: 4</td>")));
}

TEST_F(EstimatePage, ComponentsTruthsAndErrorBarsBelongTogether) {
  const EstimateTable one = table(
      "file,force_x_N,force_y_N,force_z_N,sigma_force_y_N,true_force_x_N,true_y_N,torque_z_Nmm,contact_mm2,touched,"
      "slip,"
      "fault\na.png,1,2,3,0.1,1,2,4,5,1,sticking,\nb.png,1,2,3,0.1,1,2,4,5,0,,the picture can't be read: it is cut "
      "off\n");
  const EstimateParts parts = parts_of(one);
  ASSERT_EQ(parts.quantities.size(), 3U);
  const EstimatedQuantity& force = parts.quantities[0];
  EXPECT_EQ(force.name, "force");
  EXPECT_EQ(force.unit, "N");
  ASSERT_EQ(force.components.size(), 3U);
  EXPECT_EQ(force.components[0].truth, one.column("true_force_x_N"));
  EXPECT_EQ(force.components[1].truth, one.column("true_y_N"));
  EXPECT_EQ(force.components[1].sigma, one.column("sigma_force_y_N"));
  EXPECT_EQ(force.components[2].truth, nullptr);
  EXPECT_EQ(parts.quantities[1].unit, "N mm");
  EXPECT_EQ(parts.quantities[2].name, "contact");
  EXPECT_THAT(parts.flags, ElementsAre(one.column("touched")));
  EXPECT_THAT(parts.states, ElementsAre(one.column("slip")));
  EXPECT_THAT(parts.remarks, ElementsAre(one.column("fault")));
}

TEST_F(EstimatePage, LinesOfOneFrameAreTakenTogether) {
  const EstimateTable one = table(
      "sequence,frame,t_us,marker,x_px,y_px,dx_px,dy_px,trusted,status\n"
      "a,0,0,0,5,5,3,4,1,found\na,0,0,1,9,5,0,0,1,found\na,1,40000,0,5,5,6,8,1,found\na,1,40000,1,9,5,0,0,0,hidden\n"
      "b,0,7000,0,5,5,0,0,1,found\n");
  const std::vector<EstimateSequence> sequences = sequences_of(one);
  ASSERT_EQ(sequences.size(), 2U);
  ASSERT_EQ(sequences[0].frames.size(), 2U);
  EXPECT_EQ(sequences[0].frames[1].first, 2U);
  EXPECT_EQ(sequences[0].frames[1].count, 2U);
  EXPECT_DOUBLE_EQ(sequences[0].frames[1].at, 0.04);
  EXPECT_DOUBLE_EQ(sequences[1].frames[0].at, 0.0);
  const EstimateParts parts = parts_of(one);
  ASSERT_EQ(parts.quantities.size(), 1U) << "where a marker is says nothing over time";
  const std::string html = estimate_page("markers", {one}, {});
  EXPECT_THAT(html, AllOf(HasSubstr("size of displacement"), HasSubstr("largest"), HasSubstr("3 frames in 2 sequences"),
                          HasSubstr("All frames are trusted")));
}

TEST_F(EstimatePage, TimesThatAreMissingOrGoBackGiveWayToNumbers) {
  for (const char* const times : {"0,0,1\n1,,1\n2,80000,1\n", "0,0,1\n1,90000,1\n2,80000,1\n"}) {
    const std::vector<EstimateSequence> sequences = sequences_of(table(std::string("frame,t_us,force_z_N\n") + times));
    EXPECT_EQ(sequences[0].axis, "frame");
    EXPECT_DOUBLE_EQ(sequences[0].frames[2].at, 2.0);
  }
  EXPECT_DOUBLE_EQ(sequences_of(table("file,highest_mm\nb,1\na,2\n"))[0].frames[1].at, 1.0);
}

TEST_F(EstimatePage, SlipAndContactAreStripsAndTextsAreOnlyTexts) {
  const std::string html = page(
      "frame,file,t_us,touched,slip,status\n0,<script>,0,0,no contact,normal\n1,a,1000,1,sticking,normal\n"
      "2,b,2000,1,sliding,<b>dark & cold and much longer than a state</b>\n");
  EXPECT_THAT(html, AllOf(HasSubstr("what was seen"), HasSubstr(">sliding<"), HasSubstr(">touched<"),
                          HasSubstr("&lt;b&gt;dark &amp; cold"), Not(HasSubstr("<b>")), Not(HasSubstr("<script>"))));
}

TEST_F(EstimatePage, ALongRecordingKeepsItsPeaks) {
  std::string text = "frame,force_z_N\n";
  for (int i = 0; i < 20000; ++i) text += fmt::format("{},{}\n", i, i == 12345 ? 77.0 : 1.0);
  const std::string html = page(text);
  EXPECT_LT(html.size(), 60000U);
  EXPECT_THAT(html, HasSubstr(">80<"));  // the axis reaches it
}

TEST_F(EstimatePage, TheSameTablesMakeTheSameBytesWithPictures) {
  fs::create_directories(folder_.path() / "overlay/a");
  for (const int i : {1, 2, 10}) {
    sim::write_png(folder_.path() / fmt::format("overlay/a/{}.png", i), cv::Mat(20, 30, CV_8UC3, cv::Scalar(i, 99, 9)));
  }
  const std::vector<fs::path> pictures = pictures_below(folder_.path() / "overlay");
  ASSERT_EQ(pictures.size(), 3U);
  EXPECT_EQ(pictures[2].filename(), "10.png");
  const EstimateTable one = table("frame,force_z_N\n0,1\n1,2\n");
  const std::string html = estimate_page("t", {one}, pictures);
  EXPECT_EQ(html, estimate_page("t", {one}, pictures));
  EXPECT_THAT(html, HasSubstr("3 of 3 frames with what was estimated of them"));
}

TEST_F(EstimatePage, TablesThatCantBeReadAreNamed) {
  EXPECT_THAT(message_of([&] { table(""); }), HasSubstr("t0.csv: has no line of estimates"));
  EXPECT_THAT(message_of([&] { table("a,b\n"); }), HasSubstr("t1.csv: has no line of estimates"));
  EXPECT_THAT(message_of([&] { table("a,b\n1\n"); }), HasSubstr("t2.csv:2: has 1 cells; the first line names 2"));
  EXPECT_THAT(message_of([&] { table("a,a\n1,2\n"); }), HasSubstr("t3.csv:1: two columns are called 'a'"));
  EXPECT_THAT(message_of([&] { table("a,\n1,2\n"); }), HasSubstr("t4.csv:1: a column has no name"));
  EXPECT_THAT(message_of([&] { table("a,b\n\"1,2\n"); }), HasSubstr("t5.csv:2: a quote has no end"));
  fs::create_directories(folder_.path() / "empty");
  EXPECT_THAT(message_of([&] { estimate_tables(folder_.path() / "empty"); }),
              HasSubstr("isn't a data set (dataset.json), nor a folder with tables of estimates (*.csv)"));
}

TEST_F(EstimatePage, NumbersThatAreNoneAreWords) {
  const EstimateTable one = table("frame,force_z_N,x\n0,nan,inf\n1,2,\n");
  EXPECT_FALSE(one.column("force_z_N")->is_numeric());
  EXPECT_NO_THROW(estimate_page("t", {one}, {}));
}

}  // namespace
}  // namespace touchstone::datasets
