#include "sim/files/image_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>
#include <zlib.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <limits>
#include <opencv2/core.hpp>
#include <thread>

#include "core/error.h"
#include "core/whole_file.h"
#include "render/imager/jpeg.h"

// OpenImageIO loses an error message's 31 bytes with each damaged PNG, when libpng jumps over its destructors.
extern "C" const char* __lsan_default_suppressions() {
  return "leak:libOpenImageIO";
}

namespace touchstone::sim {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;

cv::Mat pattern(int type, int width = 37, int height = 23) {
  cv::Mat image(height, width, type);
  cv::RNG random(7);
  random.fill(image, cv::RNG::UNIFORM, 0, CV_MAT_DEPTH(type) == CV_8U ? 256 : 65536);
  return image;
}

bool same(const cv::Mat& a, const cv::Mat& b) {
  return a.type() == b.type() && a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0.0;
}

/// Something smooth with noise, as a camera's picture.
cv::Mat frame_like(int width = 160, int height = 120) {
  cv::Mat image(height, width, CV_8UC3);
  cv::RNG random(7);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      image.at<cv::Vec3b>(y, x) = {cv::saturate_cast<uchar>(90 + 0.2 * x + random.gaussian(2)),
                                   cv::saturate_cast<uchar>(100 + 0.5 * y + random.gaussian(2)),
                                   cv::saturate_cast<uchar>(120 - 0.3 * y + random.gaussian(2))};
    }
  }
  return image;
}

template <typename T>
void put(std::string& bytes, T number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

/// The pixels with rows from the bottom.
std::string bmp_of(const cv::Mat& image) {
  const auto row = static_cast<std::uint32_t>(image.cols) * 3;  // of a width that 4 divides
  const std::uint32_t size = row * static_cast<std::uint32_t>(image.rows);
  std::string bytes = "BM";
  for (const std::uint32_t field : {54 + size, 0U, 54U, 40U}) put(bytes, field);
  put(bytes, image.cols);
  put(bytes, image.rows);
  put(bytes, std::uint16_t{1});
  put(bytes, std::uint16_t{24});
  for (const std::uint32_t field : {0U, size, 2835U, 2835U, 0U, 0U}) put(bytes, field);
  for (int y = image.rows - 1; y >= 0; --y) bytes.append(image.ptr<char>(y), row);
  return bytes;
}

/// One strip, of grey pixels as they are or packed by zlib.
std::string tiff_of(const cv::Mat& grey, bool zipped) {
  std::string strip(grey.ptr<char>(), grey.total());
  if (zipped) {
    uLongf size = compressBound(grey.total());
    std::string packed(size, '\0');
    compress(reinterpret_cast<Bytef*>(packed.data()), &size, grey.data, grey.total());
    strip = packed.substr(0, size);
  }
  constexpr std::uint16_t kShort = 3, kLong = 4;
  const auto rows = static_cast<std::uint32_t>(grey.rows), columns = static_cast<std::uint32_t>(grey.cols);
  constexpr std::uint32_t kStripAt = 8;
  std::string bytes("II*\0", 4);
  put(bytes, kStripAt + static_cast<std::uint32_t>(strip.size() + strip.size() % 2));
  bytes += strip + std::string(strip.size() % 2, '\0');
  const std::vector<std::array<std::uint32_t, 3>> fields = {{256, kLong, columns},
                                                            {257, kLong, rows},
                                                            {258, kShort, 8},
                                                            {259, kShort, zipped ? 8U : 1U},
                                                            {262, kShort, 1},
                                                            {273, kLong, kStripAt},
                                                            {277, kShort, 1},
                                                            {278, kLong, rows},
                                                            {279, kLong, static_cast<std::uint32_t>(strip.size())}};
  put(bytes, static_cast<std::uint16_t>(fields.size()));
  for (const auto& [tag, type, value] : fields) {
    put(bytes, static_cast<std::uint16_t>(tag));
    put(bytes, static_cast<std::uint16_t>(type));
    put(bytes, std::uint32_t{1});
    put(bytes, value);
  }
  put(bytes, std::uint32_t{0});
  return bytes;
}

class ImageFile : public testing::Test {
 protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) / ("touchstone_image_file_" + std::to_string(getpid()));
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  bool empty() const { return fs::directory_iterator(folder_) == fs::directory_iterator(); }

  // What read_image says of the file.
  std::string complaint(const fs::path& path) const {
    try {
      read_image(path);
    } catch (const Error& error) {
      EXPECT_THAT(error.what(), HasSubstr(path.string()));
      EXPECT_THAT(error.what(), testing::Not(HasSubstr("\n")));
      return error.what();
    }
    return "";
  }

  fs::path folder_;
};

TEST_F(ImageFile, PngGivesBackEachNumber) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_16UC3}) {
    const cv::Mat image = pattern(type);
    const cv::Mat before = image.clone();
    write_png(folder_ / "a.png", image);
    EXPECT_TRUE(same(read_image(folder_ / "a.png"), before)) << type;
    EXPECT_TRUE(same(image, before)) << "the caller's picture is left alone";
  }
  const cv::Mat one = pattern(CV_8UC1, 1, 1);
  write_png(folder_ / "a.png", one);
  EXPECT_TRUE(same(read_image(folder_ / "a.png"), one));
}

TEST_F(ImageFile, PartOfAPictureIsWrittenRowByRow) {
  const cv::Mat whole = pattern(CV_16UC1, 50, 40);
  const cv::Mat part = whole(cv::Rect(7, 5, 20, 11));
  ASSERT_FALSE(part.isContinuous());
  write_png(folder_ / "a.png", part);
  EXPECT_TRUE(same(read_image(folder_ / "a.png"), part.clone()));
}

// Writer and reader could both be wrong in the same way, so the file read here is made by hand.
TEST_F(ImageFile, RedIsRedInTheFile) {
  // A PPM: red, green, blue, white.
  std::ofstream(folder_ / "hand.ppm", std::ios::binary) << "P6\n2 2\n255\n"
                                                        << std::string("\xff\0\0\0\xff\0\0\0\xff\xff\xff\xff", 12);
  const cv::Mat image = read_image(folder_ / "hand.ppm");
  ASSERT_EQ(image.type(), CV_8UC3);
  EXPECT_EQ(image.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(image.at<cv::Vec3b>(0, 1), cv::Vec3b(0, 255, 0));
  EXPECT_EQ(image.at<cv::Vec3b>(1, 0), cv::Vec3b(255, 0, 0));
  write_png(folder_ / "a.png", image);
  EXPECT_TRUE(same(read_image(folder_ / "a.png"), image));
}

TEST_F(ImageFile, SamePictureGivesTheSameBytesASecondLater) {
  const cv::Mat frame = pattern(CV_8UC3);
  cv::Mat light;
  pattern(CV_16UC3).convertTo(light, CV_32F, 1e-4);
  const auto write = [&](const std::string& name) {
    write_png(folder_ / (name + ".png"), frame, {{"seed", "7"}});
    write_exr(folder_ / (name + ".exr"), light, {"R", "G", "B"}, {{"seed", "7"}});
  };
  write("a");
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));  // time stamps in files count seconds
  write("b");
  EXPECT_TRUE(read_whole_file(folder_ / "a.png") == read_whole_file(folder_ / "b.png"));
  EXPECT_TRUE(read_whole_file(folder_ / "a.exr") == read_whole_file(folder_ / "b.exr"));
}

TEST_F(ImageFile, ExrGivesBackEachFloatByItsChannelsName) {
  cv::Mat light;
  pattern(CV_16UC3).convertTo(light, CV_32F, 1e-3);
  light.at<cv::Vec3f>(3, 4) = {1e-30F, 3e30F, -0.0F};
  write_exr(folder_ / "a.exr", light, {"R", "G", "B"});
  const LinearImage read = read_exr(folder_ / "a.exr");
  EXPECT_EQ(read.channel_names, (std::vector<std::string>{"R", "G", "B"}));
  EXPECT_TRUE(same(read.image, light));

  const std::vector<std::string> names = {"540nm", "450nm"};  // not in the order that the file keeps
  const cv::Mat two(5, 4, CV_32FC2, cv::Scalar(5.0, 4.0));
  write_exr(folder_ / "b.exr", two, names);
  const LinearImage sorted = read_exr(folder_ / "b.exr");
  ASSERT_EQ(sorted.channel_names.size(), 2u);
  for (int i = 0; i < 2; ++i) {
    EXPECT_EQ(sorted.image.at<cv::Vec2f>(2, 2)[i], sorted.channel_names[i] == "540nm" ? 5.0F : 4.0F);
  }
  const cv::Mat grey(3, 3, CV_32FC1, cv::Scalar(0.125));
  write_exr(folder_ / "c.exr", grey, {"Y"});
  EXPECT_TRUE(same(read_exr(folder_ / "c.exr").image, grey));
}

TEST_F(ImageFile, MetadataIsKept) {
  write_png(folder_ / "a.png", pattern(CV_8UC1), {{"touchstone.seed", "18446744073709551615"}, {"unit", "DN"}});
  EXPECT_EQ(image_metadata(folder_ / "a.png", "touchstone.seed"), "18446744073709551615");
  EXPECT_EQ(image_metadata(folder_ / "a.png", "unit"), "DN");
  EXPECT_EQ(image_metadata(folder_ / "a.png", "nothing"), "");
  write_exr(folder_ / "a.exr", cv::Mat(2, 2, CV_32FC1, cv::Scalar(1)), {"Y"}, {{"unit", "W/m^2"}});
  EXPECT_EQ(image_metadata(folder_ / "a.exr", "unit"), "W/m^2");
  EXPECT_THROW(write_png(folder_ / "b.png", pattern(CV_8UC1), {{"", "x"}}), Error);
  EXPECT_THROW(write_png(folder_ / "b.png", pattern(CV_8UC1), {{"DateTime", "2026:01:01 00:00:00"}}), Error);
  EXPECT_FALSE(fs::exists(folder_ / "b.png"));
}

TEST_F(ImageFile, PicturesThatTheFormatCannotHoldAreRefused) {
  for (const cv::Mat& bad : {cv::Mat(), cv::Mat(3, 3, CV_32FC1), cv::Mat(3, 3, CV_8UC2), cv::Mat(3, 3, CV_16SC1)}) {
    EXPECT_THROW(write_png(folder_ / "a.png", bad), Error);
  }
  EXPECT_THROW(write_exr(folder_ / "a.exr", cv::Mat(), {}), Error);
  EXPECT_THROW(write_exr(folder_ / "a.exr", pattern(CV_8UC1), {"Y"}), Error);
  const cv::Mat two(3, 3, CV_32FC2, cv::Scalar::all(0));
  EXPECT_THROW(write_exr(folder_ / "a.exr", two, {"Y"}), Error);
  EXPECT_THROW(write_exr(folder_ / "a.exr", two, {"Y", "Y"}), Error);
  EXPECT_THROW(write_exr(folder_ / "a.exr", two, {"Y", ""}), Error);
  EXPECT_TRUE(empty()) << "nothing is written";
}

TEST_F(ImageFile, PlacesThatCannotBeWrittenAreNamed) {
  const fs::path path = folder_ / "missing" / "a.png";
  try {
    write_png(path, pattern(CV_8UC1));
    ADD_FAILURE() << "wrote into a folder that isn't there";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr(path.string()));
  }
  EXPECT_TRUE(empty());
}

TEST_F(ImageFile, DamagedFilesAreRefusedByName) {
  EXPECT_THAT(complaint(folder_ / "missing.png"), HasSubstr("no such file"));
  EXPECT_NE(complaint(folder_), "") << "a folder";
  write_whole_file(folder_ / "empty.png", "");
  EXPECT_NE(complaint(folder_ / "empty.png"), "");
  write_whole_file(folder_ / "text.png", "this is no picture\n");
  EXPECT_NE(complaint(folder_ / "text.png"), "");
  write_png(folder_ / "a.png", pattern(CV_8UC3, 200, 100));
  const std::string whole = read_whole_file(folder_ / "a.png");
  for (const std::size_t length : {whole.size() / 2, std::size_t{40}, std::size_t{8}}) {
    write_whole_file(folder_ / "short.png", whole.substr(0, length));
    EXPECT_NE(complaint(folder_ / "short.png"), "") << length << " bytes of " << whole.size();
  }
  write_exr(folder_ / "a.exr", cv::Mat(2, 2, CV_32FC1, cv::Scalar(1)), {"Y"});
  EXPECT_THAT(complaint(folder_ / "a.exr"), HasSubstr("floats"));
  EXPECT_THROW(read_exr(folder_ / "a.png"), Error);
}

TEST_F(ImageFile, NamesAreTakenAsTheyAre) {
  const cv::Mat image = pattern(CV_8UC3);
  for (const char* name : {"a?b=1.png", "?.png", "a*[0-9].png", "a%04d#.png", "a\nb.png", "\xff.png", "a?b"}) {
    fs::create_directories(folder_ / name / name);
    write_png(folder_ / name / "c.png", image);
    EXPECT_TRUE(same(read_image(folder_ / name / "c.png"), image)) << name;
    write_png(folder_ / name / "c?d.png", image, {{"unit", "DN"}});
    EXPECT_TRUE(same(read_image(folder_ / name / "c?d.png"), image)) << name;
    EXPECT_EQ(image_metadata(folder_ / name / "c?d.png", "unit"), "DN");
    write_whole_file(folder_ / name / "c?d.jpg", render::jpeg_bytes(image, {}));
    EXPECT_EQ(read_image(folder_ / name / "c?d.jpg").size(), image.size()) << name;
  }
  write_whole_file(folder_ / "text?.png", "this is no picture\n");
  EXPECT_NE(complaint(folder_ / "text?.png"), "");
}

TEST_F(ImageFile, CutPicturesOfEveryKindAreRefusedByName) {
  const cv::Mat frame = frame_like();
  cv::Mat grey;
  cv::extractChannel(frame, grey, 1);
  write_png(folder_ / "whole.png", frame);
  const std::vector<std::pair<std::string, std::string>> kinds = {{"a.png", read_whole_file(folder_ / "whole.png")},
                                                                  {"a.jpg", render::jpeg_bytes(frame, {})},
                                                                  {"grey.jpg", render::jpeg_bytes(grey, {})},
                                                                  {"a.bmp", bmp_of(frame)},
                                                                  {"plain.tif", tiff_of(grey, false)},
                                                                  {"zipped.tif", tiff_of(grey, true)}};
  for (const auto& [name, bytes] : kinds) {
    write_whole_file(folder_ / name, bytes);
    ASSERT_EQ(complaint(folder_ / name), "");
    const cv::Mat whole = read_image(folder_ / name);
    EXPECT_EQ(whole.size(), frame.size()) << name;
    // A TIFF's list of strips stands behind them: of a file that is cut there, only its last entry may be missing.
    for (const double share : {0.01, 0.2, 0.5, 0.65, 0.9, 0.99}) {
      const auto length = static_cast<std::size_t>(share * static_cast<double>(bytes.size()));
      write_whole_file(folder_ / name, bytes.substr(0, length));
      EXPECT_NE(complaint(folder_ / name), "") << name << ", " << length << " bytes of " << bytes.size();
    }
  }
}

/// EXIF with nothing but an orientation, as phones and cameras write it behind a JPEG's first two bytes.
std::string turned_jpeg(const std::string& jpeg, int orientation) {
  std::string exif = std::string("Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0", 25);
  exif += static_cast<char>(orientation);
  exif += std::string(6, '\0');
  std::string segment = "\xff\xe1";
  segment += '\0';
  segment += static_cast<char>(exif.size() + 2);
  return jpeg.substr(0, 2) + segment + exif + jpeg.substr(2);
}

// The EXIF standard (CIPA DC-008, 4.6.4 A, tag 274) says where the stored picture's first row and first column belong.
TEST_F(ImageFile, PicturesThatACameraHasMarkedAsTurnedAreTurned) {
  const cv::Mat frame = frame_like(40, 24);
  const std::string jpeg = render::jpeg_bytes(frame, {});
  const fs::path file = folder_ / "turned.jpg";
  write_whole_file(file, jpeg);
  const cv::Mat stored = read_image(file);
  const int last_row = stored.rows - 1, last_column = stored.cols - 1;
  for (int orientation = 0; orientation <= 9; ++orientation) {
    SCOPED_TRACE(orientation);
    write_whole_file(file, turned_jpeg(jpeg, orientation));
    const cv::Mat image = read_image(file);
    const bool swaps = orientation >= 5 && orientation <= 8;
    ASSERT_EQ(image.size(), swaps ? cv::Size(stored.rows, stored.cols) : stored.size());
    for (int r = 0; r < stored.rows; ++r) {
      for (int c = 0; c < stored.cols; ++c) {
        cv::Point to(c, r);
        if (orientation == 2) to = {last_column - c, r};  // first column at the right
        if (orientation == 3)
          to = {last_column - c, last_row - r};        // first row at the bottom, first column at the right
        if (orientation == 4) to = {c, last_row - r};  // first row at the bottom
        if (orientation == 5) to = {r, c};             // first row at the left, first column at the top
        if (orientation == 6) to = {last_row - r, c};  // first row at the right, first column at the top
        if (orientation == 7)
          to = {last_row - r, last_column - c};           // first row at the right, first column at the bottom
        if (orientation == 8) to = {r, last_column - c};  // first row at the left, first column at the bottom
        ASSERT_EQ(image.at<cv::Vec3b>(to), stored.at<cv::Vec3b>(r, c));
      }
    }
  }
}

TEST_F(ImageFile, AJpegDamagedInsideIsRefused) {
  const std::string whole = render::jpeg_bytes(frame_like(320, 240), {});
  const std::size_t pixels = whole.find("\xff\xda") + 14;
  const auto fault = [&](std::string damaged) {
    write_whole_file(folder_ / "a.jpg", damaged);
    return complaint(folder_ / "a.jpg");
  };
  ASSERT_EQ(fault(whole), "");
  // Filled up behind its pixels, or followed by something, as some cameras make them.
  EXPECT_EQ(fault(whole.substr(0, whole.size() - 2) + std::string(3, '\0') + "\xff\xff\xd9"), "");
  EXPECT_EQ(fault(whole + std::string(100, 'x')), "");
  for (const double share : {0.1, 0.3, 0.5, 0.7, 0.9}) {
    std::string damaged = whole;
    const std::size_t at = pixels + static_cast<std::size_t>(share * static_cast<double>(whole.size() - pixels - 1000));
    EXPECT_NE(fault(damaged.replace(at, 900, std::string(900, '\0'))), "") << share;
    damaged = whole;
    EXPECT_NE(fault(damaged.erase(at, 900)), "") << share;
    damaged = whole;
    EXPECT_NE(fault(damaged.insert(at, whole.substr(pixels, 900))), "") << share;
  }
  // A few bytes too many at the end, which libjpeg itself passes over.
  std::string longer = whole;
  longer.insert(whole.size() - 2, "\x55");
  EXPECT_THAT(fault(longer), HasSubstr("more of them than its size takes"));
}

TEST_F(ImageFile, ATiffWhoseCutPartIsLedToIsRefused) {
  cv::Mat grey;
  cv::extractChannel(frame_like(), grey, 1);
  for (const bool zipped : {false, true}) {
    std::string bytes = tiff_of(grey, zipped);
    // The list of fields first, as most programs write it: then a cut file still has it.
    const std::size_t list = bytes.size() - (2 + 9 * 12 + 4);
    const std::string fields = bytes.substr(list);
    std::string front = bytes.substr(0, 4);
    put(front, std::uint32_t{8});
    front += fields;
    const auto strip_at = static_cast<std::uint32_t>(front.size());
    std::memcpy(front.data() + 8 + 2 + 5 * 12 + 8, &strip_at, sizeof strip_at);
    const std::string whole = front + bytes.substr(8, list - 8);
    write_whole_file(folder_ / "a.tif", whole);
    EXPECT_TRUE(same(read_image(folder_ / "a.tif"), grey));
    for (const double share : {0.1, 0.65, 0.99}) {
      write_whole_file(folder_ / "a.tif",
                       whole.substr(0, static_cast<std::size_t>(share * static_cast<double>(whole.size()))));
      EXPECT_NE(complaint(folder_ / "a.tif"), "") << zipped << " " << share;
    }
    if (!zipped) continue;
    std::string damaged = whole;
    damaged[whole.size() / 2] = static_cast<char>(damaged[whole.size() / 2] ^ 1);
    write_whole_file(folder_ / "a.tif", damaged);
    EXPECT_NE(complaint(folder_ / "a.tif"), "");
  }
}

TEST_F(ImageFile, NoDamagedBitOfAPngMakesALibraryPrint) {
  write_png(folder_ / "a.png", pattern(CV_8UC3, 5, 4), {{"touchstone", "kept"}});
  const std::string whole = read_whole_file(folder_ / "a.png");
  constexpr std::size_t kHeadEnd = 33;  // the signature and IHDR
  const std::size_t pixels = whole.find("IDAT");
  const std::size_t end = whole.find("IEND") - 4;
  testing::internal::CaptureStderr();
  for (std::size_t bit = 0; bit < 8 * end; ++bit) {
    std::string damaged = whole;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    write_whole_file(folder_ / "damaged.png", damaged);
    const bool needed = bit / 8 < kHeadEnd || bit / 8 >= pixels - 4;  // between them stand notes
    EXPECT_TRUE(!complaint(folder_ / "damaged.png").empty() || !needed) << "bit " << bit % 8 << " of byte " << bit / 8;
  }
  for (std::size_t length = 0; length < end; ++length) {
    write_whole_file(folder_ / "short.png", whole.substr(0, length));
    EXPECT_NE(complaint(folder_ / "short.png"), "") << length << " bytes of " << whole.size();
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");

  std::string damaged = whole;
  damaged[pixels + 10] = static_cast<char>(damaged[pixels + 10] ^ 1);
  write_whole_file(folder_ / "damaged.png", damaged);
  EXPECT_THAT(complaint(folder_ / "damaged.png"), HasSubstr("its chunk IDAT isn't what its checksum says"));
}

TEST_F(ImageFile, ANoteLongerThanItsExrIsRefusedBeforeMemoryIsAskedFor) {
  write_exr(folder_ / "a.exr", cv::Mat(2, 2, CV_32FC1, cv::Scalar(1)), {"Y"}, {{"touchstone", "kept"}});
  std::string bytes = read_whole_file(folder_ / "a.exr");
  const std::string note("touchstone\0string\0", 18);
  const std::size_t length = bytes.find(note) + note.size();
  ASSERT_LT(length, bytes.size());
  ASSERT_EQ(bytes[length], 4);
  const auto fault = [&](const std::string& said) {
    std::string damaged = bytes;
    damaged.replace(length, 4, said);
    write_whole_file(folder_ / "b.exr", damaged);
    return complaint(folder_ / "b.exr");
  };
  EXPECT_THAT(fault("\xff\xff\xff\x7f"), HasSubstr("a note of its header is longer than the file"));
  const std::size_t left = bytes.size() - length - 4;
  const std::string just{static_cast<char>((left + 1) & 0xff), static_cast<char>((left + 1) >> 8), 0, 0};
  EXPECT_THAT(fault(just), HasSubstr("a note of its header is longer than the file"));
  EXPECT_EQ(read_exr(folder_ / "a.exr").image.rows, 2);
}

TEST_F(ImageFile, MorePixelsThanAreReadAreRefusedByName) {
  write_png(folder_ / "large.png", cv::Mat(10001, 10000, CV_8UC1, cv::Scalar(0)));
  EXPECT_THAT(complaint(folder_ / "large.png"),
              AllOf(HasSubstr("large.png"), HasSubstr("10000x10001 pixels; at most 100000000 are read")));
}

// The promise that commands which touch no image file don't pay for OpenImageIO.
TEST(ImageModule, IsLoadedByTheFirstUseOnly) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");  // a new process, in which nothing was read yet
  const auto loaded = [] { return read_whole_file("/proc/self/maps").find("libOpenImageIO.so") != std::string::npos; };
  EXPECT_EXIT(
      {
        const bool before = loaded();
        try {
          read_image("/proc/self/exe");
        } catch (const Error&) {
        }
        _exit(!before && loaded() ? 0 : 1);
      },
      testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace touchstone::sim
