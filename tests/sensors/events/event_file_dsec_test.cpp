#include "sensors/events/event_file_dsec.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <array>
#include <limits>
#include <optional>

#include "core/error.h"
#include "core/whole_file.h"
#include "sensors/events/event_file.h"
#include "tests/sensors/events/event_vectors.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::sensors {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class DsecEvents : public ::testing::Test {
 protected:
  DsecEvents() : file_(folder_.path() / "e.h5") {}

  /// A file with the arrays of the published layout, of types T.
  template <typename T>
  void write(const std::vector<T>& t, const std::vector<T>& x, const std::vector<T>& y, const std::vector<T>& p,
             std::optional<std::int64_t> offset) {
    Hdf5Writer writer(file_);
    const auto put = [&](const char* path, const std::vector<T>& values) {
      writer.write<T>({path, "", "", "", ""}, static_cast<std::int64_t>(values.size()), {}, values);
    };
    put("/events/t", t);
    put("/events/x", x);
    put("/events/y", y);
    put("/events/p", p);
    if (offset) writer.write_number({"/t_offset", "", "", "", ""}, *offset);
    writer.close();
  }
  std::string refusal() {
    return message_of([&] { read_events(file_); });
  }

  test::TemporaryFolder folder_;
  std::filesystem::path file_;
};

/// Writes '/events/p' anew, of any type of HDF5.
void write_polarities(const std::filesystem::path& file, hid_t type, const std::vector<std::int8_t>& values) {
  const hid_t in = H5Fopen(file.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  ASSERT_GE(in, 0);
  H5Ldelete(in, "/events/p", H5P_DEFAULT);
  const hsize_t count = values.size();
  const hid_t space = H5Screate_simple(1, &count, nullptr);
  const hid_t set = H5Dcreate2(in, "/events/p", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  EXPECT_GE(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0);
  H5Dclose(set);
  H5Sclose(space);
  H5Fclose(in);
}

TEST_F(DsecEvents, PolaritiesMayBeSignedOrTruthValues) {
  const auto polarities = [&] {
    std::vector<bool> on;
    for (const Event& event : read_events(file_).events) on.push_back(event.on);
    return on;
  };
  write<std::uint32_t>({7, 9, 9}, {0, 0, 0}, {0, 0, 0}, {1, 0, 1}, {});
  write_polarities(file_, H5T_NATIVE_INT8, {1, -1, 1});
  EXPECT_THAT(polarities(), ElementsAre(true, false, true));
  const hid_t truth = H5Tenum_create(H5T_NATIVE_INT8);  // as h5py writes bool
  std::int8_t value = 0;
  H5Tenum_insert(truth, "FALSE", &value);
  value = 1;
  H5Tenum_insert(truth, "TRUE", &value);
  write_polarities(file_, truth, {1, 0, 1});
  H5Tclose(truth);
  EXPECT_THAT(polarities(), ElementsAre(true, false, true));
  write_polarities(file_, H5T_NATIVE_INT8, {1, -2, 1});
  EXPECT_THAT(refusal(), HasSubstr("event 1 has polarity -2; allowed is 1 for ON, 0 or -1 for OFF"));
}

TEST_F(DsecEvents, TheOffsetIsAddedToTheTimes) {
  write<std::uint32_t>({7, 9}, {639, 1}, {479, 2}, {1, 0}, 4'000'000'000'000);
  const EventRecording back = read_events(file_);
  EXPECT_THAT(back.events,
              ElementsAre(Event{4'000'000'000'007, 639, 479, true}, Event{4'000'000'000'009, 1, 2, false}));
  EXPECT_EQ(back.source.size, std::nullopt) << "the layout doesn't say it";
}

TEST_F(DsecEvents, WholeNumbersOfAnySizeAreRead) {
  write<std::int64_t>({-7, 9}, {639, 1}, {479, 2}, {1, 0}, std::nullopt);
  EXPECT_THAT(read_events(file_).events, ElementsAre(Event{-7, 639, 479, true}, Event{9, 1, 2, false}));
}

TEST_F(DsecEvents, WhatDoesntFitIsRefusedAndNotClipped) {
  write<std::int64_t>({1, 2}, {0, 70'000}, {0, 0}, {0, 0}, 0);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("event 1"), HasSubstr("70000"), HasSubstr("65535")));
  write<std::int64_t>({1, 2}, {0, 0}, {0, -1}, {0, 0}, 0);
  EXPECT_THAT(refusal(), HasSubstr("row -1"));
  write<std::int64_t>({1, 2}, {0, 0}, {0, std::int64_t{1} << 40}, {0, 0}, 0);
  EXPECT_THAT(refusal(), HasSubstr("event 1"));
  write<std::int64_t>({1, 2}, {0, 0}, {0, 0}, {0, 2}, 0);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("polarity 2"), HasSubstr("1 for ON")));
  write<std::int64_t>({3, 2}, {0, 0}, {0, 0}, {0, 0}, 0);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("event 1"), HasSubstr("2 us"), HasSubstr("3 us")));
  write<std::int64_t>({std::numeric_limits<std::int64_t>::max()}, {0}, {0}, {0}, 1);
  EXPECT_THAT(refusal(), HasSubstr("64 bits"));
}

TEST_F(DsecEvents, ArraysMustBeThereBeWholeNumbersAndOfOneLength) {
  write<std::uint16_t>({1, 2}, {0}, {0, 0}, {0, 0}, 0);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("/events/x"), HasSubstr("holds 1 numbers")));
  write<double>({1, 2}, {0, 0}, {0, 0}, {0, 0}, 0);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("/events/t"), HasSubstr("whole numbers")));
  {
    Hdf5Writer writer(file_);
    writer.write<std::uint16_t>({"/events/t", "", "", "", ""}, 1, {2}, std::vector<std::uint16_t>{1, 2});
    writer.close();
  }
  EXPECT_THAT(refusal(), HasSubstr("2 axes"));
  {
    Hdf5Writer writer(file_);
    writer.write<std::uint16_t>({"/other", "", "", "", ""}, 1, {}, std::vector<std::uint16_t>{1});
    writer.close();
  }
  EXPECT_THAT(refusal(), HasSubstr("/events/t"));
}

TEST_F(DsecEvents, OtherFilesOfOursAreReported) {
  const auto write_attributes = [&](const std::string& format, std::int64_t version, std::int64_t width) {
    Hdf5Writer writer(file_);
    writer.set_attribute("format", format);
    writer.set_attribute("format_version", version);
    writer.set_attribute("width", width);
    writer.set_attribute("height", std::int64_t{3});
    writer.close();
  };
  write_attributes("touchstone-truth", 1, 3);
  EXPECT_THAT(refusal(), HasSubstr("touchstone-truth"));
  write_attributes("touchstone-events", 1, 3);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("version 1"), HasSubstr("reads 2")));
  write_attributes("touchstone-events", 2, 0);
  EXPECT_THAT(refusal(), HasSubstr("0 x 3 pixels"));
}

TEST_F(DsecEvents, WrittenFilesKeepToTheLayout) {
  const std::vector<Event> events = fixtures::bursts_of_events(5000, 3, 2500);
  EventWriter writer(file_, {346, 260}, "touchstone test");
  writer.append(events);
  writer.close();
  const Hdf5Reader reader(file_);
  EXPECT_EQ(reader.read_number("/t_offset"), 0);
  const auto t = reader.read<std::int64_t>("/events/t").values;
  const auto first = reader.read<std::int64_t>("/ms_to_idx").values;
  ASSERT_EQ(first.size(), static_cast<std::size_t>(t.back() / 1000 + 1));
  for (std::size_t ms = 0; ms < first.size(); ++ms) {
    const auto i = static_cast<std::size_t>(first[ms]);
    ASSERT_GE(t[i], static_cast<std::int64_t>(ms) * 1000);
    if (i > 0) {
      ASSERT_LT(t[i - 1], static_cast<std::int64_t>(ms) * 1000);
    }
  }
  // The types that the data set's own files have.
  const hid_t file = H5Fopen(file_.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const auto expect_type = [&](const char* path, hid_t type) {
    const hid_t dataset = H5Dopen2(file, path, H5P_DEFAULT);
    const hid_t own = H5Dget_type(dataset);
    EXPECT_GT(H5Tequal(own, type), 0) << path;
    H5Tclose(own);
    H5Dclose(dataset);
  };
  expect_type("/events/p", H5T_STD_U8LE);
  expect_type("/events/x", H5T_STD_U16LE);
  expect_type("/events/y", H5T_STD_U16LE);
  expect_type("/events/t", H5T_STD_U32LE);
  expect_type("/ms_to_idx", H5T_STD_U64LE);
  expect_type("/t_offset", H5T_STD_I64LE);
  H5Fclose(file);
}

TEST_F(DsecEvents, MoreThan32BitsOfMicrosecondsAreRefused) {
  EventWriter writer(file_, {346, 260}, "touchstone test");
  writer.append(std::vector<Event>{{0, 1, 1, true}, {4'294'967'296, 1, 1, true}});
  EXPECT_THAT(message_of([&] { writer.close(); }),
              AllOf(HasSubstr("event 1"), HasSubstr("4294967295"), HasSubstr(".raw")));
}

TEST_F(DsecEvents, DamageInTheOlderLayoutEndsNoProcess) {
  // As h5py writes by default: no checksums, and HDF5 1.10 itself crashes on some of these.
  const hid_t made = H5Fcreate(file_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t group = H5Gcreate2(made, "/events", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  const hsize_t chunk = 2;
  H5Pset_chunk(creation, 1, &chunk);
  H5Pset_deflate(creation, 4);
  const hsize_t count = 3;
  const hid_t space = H5Screate_simple(1, &count, nullptr);
  const std::array<std::int32_t, 3> values{0, 1, 1};
  for (const char* path : {"/events/t", "/events/x", "/events/y", "/events/p"}) {
    const hid_t dataset = H5Dcreate2(made, path, H5T_STD_U16LE, space, H5P_DEFAULT, creation, H5P_DEFAULT);
    H5Dwrite(dataset, H5T_NATIVE_INT32, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(dataset);
  }
  H5Sclose(space);
  H5Pclose(creation);
  H5Gclose(group);
  H5Fclose(made);
  EXPECT_EQ(read_events(file_).events.size(), 3u);
  const std::string bytes = read_whole_file(file_);
  int refused = 0;
  for (std::size_t i = 0; i < bytes.size(); i += 61) {
    std::string flipped = bytes;
    flipped[i] = static_cast<char>(flipped[i] ^ (1 << (i % 8)));
    const auto file = folder_.write("flipped.h5", flipped);
    const std::string message = message_of([&] { read_events(file); });
    if (message == "no error") continue;
    EXPECT_THAT(message, HasSubstr("flipped.h5"));
    ++refused;
  }
  EXPECT_GT(refused, 5);
}

TEST_F(DsecEvents, AFilterThatIsntThereIsNamed) {
  // 300 lies in the range that HDF5 keeps for tests, so no machine has it.
  const hid_t file = H5Fcreate(file_.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t group = H5Gcreate2(file, "/events", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t creation = H5Pcreate(H5P_DATASET_CREATE);
  const hsize_t count = 4;
  H5Pset_chunk(creation, 1, &count);
  H5Pset_filter(creation, 300, H5Z_FLAG_OPTIONAL, 0, nullptr);
  const hid_t space = H5Screate_simple(1, &count, nullptr);
  for (const char* path : {"/events/t", "/events/x", "/events/y", "/events/p"}) {
    H5Dclose(H5Dcreate2(file, path, H5T_STD_U16LE, space, H5P_DEFAULT, creation, H5P_DEFAULT));
  }
  H5Sclose(space);
  H5Pclose(creation);
  H5Gclose(group);
  H5Fclose(file);
  EXPECT_THAT(refusal(), AllOf(HasSubstr("/events/t"), HasSubstr("filter 300"), HasSubstr("HDF5_PLUGIN_PATH")));
}

}  // namespace
}  // namespace touchstone::sensors
