#include "core/hdf5_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <thread>

#include "core/error.h"
#include "core/whole_file.h"
#include "tests/support/message_of.h"
#include "tests/support/temporary_folder.h"

namespace touchstone {
namespace {

constexpr std::int64_t kRows = 700;  // several chunks

std::vector<float> row_of(std::int64_t i) {
  std::vector<float> row(300);
  for (std::size_t k = 0; k < row.size(); ++k) row[k] = static_cast<float>(i) * 0.5F + static_cast<float>(k);
  return row;
}

void write_file(const std::filesystem::path& file) {
  Hdf5Writer writer(file);
  writer.set_attribute("format", "test");
  writer.set_attribute("version", std::int64_t{3});
  writer.add_rows<float>({"/field", "mm", "samples x nodes x 3", "gel", "A field."}, kRows, {100, 3});
  writer.add_rows<std::int64_t>({"/t_us", "us", "samples", "", "Time."}, kRows, {});
  for (std::int64_t i = 0; i < kRows; ++i) {
    writer.write_row<float>("/field", i, row_of(i));
    writer.write_row<std::int64_t>("/t_us", i, std::vector<std::int64_t>{1000 * i});
  }
  writer.write<double>({"/points", "mm", "points x 3", "gel", "Points."}, 2, {3},
                       std::vector<double>{1, 2, 3, 4, 5, 6});
  writer.write<double>({"/nothing", "mm", "points x 3", "gel", "No points."}, 0, {3}, {});
  writer.write_texts({"/names", "1", "names", "", "Names."}, {"one", "a longer one", ""});
  writer.close();
}

TEST(Hdf5File, ReadsBackWhatWasWritten) {
  const test::TemporaryFolder folder;
  write_file(folder.path() / "a.h5");
  const Hdf5Reader reader(folder.path() / "a.h5");
  const auto field = reader.read<float>("/field");
  EXPECT_EQ(field.shape, (std::vector<std::int64_t>{kRows, 100, 3}));
  for (std::int64_t i = 0; i < kRows; ++i) {
    const auto at = field.values.begin() + 300 * i;
    ASSERT_EQ(std::vector<float>(at, at + 300), row_of(i));
  }
  EXPECT_EQ(reader.read<std::int64_t>("/t_us").values[699], 699000);
  EXPECT_EQ(reader.read<double>("/points").values, (std::vector<double>{1, 2, 3, 4, 5, 6}));
  EXPECT_EQ(reader.read<double>("/nothing").shape, (std::vector<std::int64_t>{0, 3}));
  EXPECT_EQ(reader.read_texts("/names"), (std::vector<std::string>{"one", "a longer one", ""}));
  EXPECT_EQ(reader.text_attribute("/field", "unit"), "mm");
  EXPECT_EQ(reader.text_attribute("/field", "shape"), "samples x nodes x 3");
  EXPECT_EQ(reader.text_attribute("/field", "frame"), "gel");
  EXPECT_EQ(reader.text_attribute("/", "format"), "test");
  EXPECT_EQ(reader.integer_attribute("/", "version"), 3);
}

TEST(Hdf5File, AGrowingDatasetKeepsAllThatWasAppended) {
  const test::TemporaryFolder folder;
  constexpr int kPortions = 300;
  {
    Hdf5Writer writer(folder.path() / "a.h5");
    writer.add_growing<std::uint16_t>({"/events/x", "pixels", "events", "", "Columns."});
    writer.add_growing<std::int64_t>({"/nothing", "us", "events", "", "Nothing."});
    std::vector<std::uint16_t> portion;
    for (int i = 0; i < kPortions; ++i) {
      writer.append<std::uint16_t>("/events/x", portion);  // the first one is empty
      portion.assign(static_cast<std::size_t>(3 * i), static_cast<std::uint16_t>(i));
    }
    writer.append<std::uint16_t>("/events/x", portion);
    writer.close();
  }
  const Hdf5Reader reader(folder.path() / "a.h5");
  const auto x = reader.read<std::uint16_t>("/events/x").values;
  ASSERT_EQ(x.size(), static_cast<std::size_t>(3 * kPortions * (kPortions - 1) / 2));
  std::size_t at = 0;
  for (int i = 0; i < kPortions; ++i) {
    for (int k = 0; k < 3 * i; ++k) ASSERT_EQ(x[at++], i);
  }
  EXPECT_EQ(reader.read<std::int64_t>("/nothing").shape, (std::vector<std::int64_t>{0}));
}

TEST(Hdf5File, SameValuesGiveTheSameBytesAtAnotherTime) {
  const test::TemporaryFolder folder;
  write_file(folder.path() / "a.h5");
  std::this_thread::sleep_for(std::chrono::milliseconds(1100));  // HDF5's time stamps count seconds
  write_file(folder.path() / "b.h5");
  EXPECT_EQ(read_whole_file(folder.path() / "a.h5"), read_whole_file(folder.path() / "b.h5"));
}

TEST(Hdf5File, IsCompressed) {
  const test::TemporaryFolder folder;
  write_file(folder.path() / "a.h5");
  EXPECT_LT(std::filesystem::file_size(folder.path() / "a.h5"), kRows * 300 * sizeof(float) / 2);
}

TEST(Hdf5File, SaysWhatItCantRead) {
  const test::TemporaryFolder folder;
  write_file(folder.path() / "a.h5");
  EXPECT_THROW(Hdf5Reader(folder.path() / "none.h5"), Error);
  EXPECT_THROW(Hdf5Reader(folder.write("text.h5", "this is no HDF5")), Error);
  const Hdf5Reader reader(folder.path() / "a.h5");
  EXPECT_THROW(reader.read<double>("/none"), Error);
  EXPECT_THROW(reader.read<double>("/names"), Error);
  EXPECT_THROW(reader.read_texts("/field"), Error);
  EXPECT_THROW(reader.text_attribute("/field", "none"), Error);
}

TEST(Hdf5File, AWalkFindsAFirstRowThatIsDamaged) {
  const test::TemporaryFolder folder;
  constexpr int kValues = 4096;
  std::vector<float> row(kValues);
  for (int k = 0; k < kValues; ++k) row[static_cast<std::size_t>(k)] = std::sin(static_cast<float>(k * k));
  const auto packed = pack_hdf5_row(row.data(), row.size() * sizeof(float), sizeof(float));
  {
    Hdf5Writer writer(folder.path() / "a.h5");
    writer.add_packed_rows<float>({"/rows", "mm", "samples x values", "", "Numbers."}, 1, {kValues});
    writer.write_packed_row("/rows", 0, packed);
    writer.write<float>({"/nothing", "mm", "samples x values", "", "None."}, 0, {kValues}, {});
    writer.write_texts({"/names", "1", "names", "", "Names."}, {"one"});
    writer.close();
  }
  const Hdf5Reader whole(folder.path() / "a.h5");
  EXPECT_NO_THROW(whole.walk_rows("/rows"));
  EXPECT_NO_THROW(whole.walk_rows("/nothing"));
  EXPECT_THROW(whole.walk_rows("/none"), Error);
  EXPECT_THROW(whole.walk_rows("/names"), Error);
  std::string bytes = read_whole_file(folder.path() / "a.h5");
  const std::size_t at = bytes.find(std::string(packed.begin(), packed.end()));
  ASSERT_NE(at, std::string::npos);
  constexpr std::size_t kDamaged = 64;
  bytes.replace(at + packed.size() / 2, kDamaged, kDamaged, '\xff');
  const Hdf5Reader damaged(folder.write("b.h5", bytes));
  EXPECT_THROW(damaged.walk_rows("/rows"), Error);
}

TEST(Hdf5File, ListsOfWholeNumbersAreReadInParts) {
  const test::TemporaryFolder folder;
  {
    Hdf5Writer writer(folder.path() / "a.h5");
    writer.write<std::uint32_t>({"/list", "us", "events", "", "Numbers."}, 3, {},
                                std::vector<std::uint32_t>{1, 4'000'000'000, 3});
    writer.write_number({"/offset", "us", "", "", "One number."}, -5);
    writer.write<double>({"/real", "us", "events", "", "Not whole."}, 1, {}, std::vector<double>{0.5});
    writer.close();
  }
  const Hdf5Reader reader(folder.path() / "a.h5");
  EXPECT_EQ(reader.count_of_whole_numbers("/list"), 3);
  std::vector<std::int64_t> part(2);
  reader.read_part<std::int64_t>("/list", 1, part);
  EXPECT_EQ(part, (std::vector<std::int64_t>{4'000'000'000, 3}));
  EXPECT_EQ(reader.read_number("/offset"), -5);
  EXPECT_NO_THROW(reader.walk_list("/list"));
  EXPECT_THROW(reader.read_number("/list"), Error) << "three";
  EXPECT_THROW(reader.read_number("/real"), Error);
  EXPECT_THROW(reader.count_of_whole_numbers("/none"), Error);
  EXPECT_THROW(reader.count_of_whole_numbers("/offset"), Error) << "no list";
  EXPECT_THROW(reader.read_part<std::int64_t>("/list", 2, part), Error) << "beyond the end";
}

TEST(Hdf5File, ABrokenOffFileIsRefused) {
  const test::TemporaryFolder folder;
  write_file(folder.path() / "a.h5");
  std::filesystem::resize_file(folder.path() / "a.h5", std::filesystem::file_size(folder.path() / "a.h5") / 2);
  EXPECT_THROW(Hdf5Reader(folder.path() / "a.h5"), Error);
}

TEST(Hdf5File, AFolderThatIsntThereIsAnError) {
  EXPECT_THROW(write_file("/nonexistent/a.h5"), Error);
}

TEST(Hdf5Trial, WhatEndsTheProcessIsAnErrorThatNamesTheFile) {
  EXPECT_EQ(test::message_of([] { try_hdf5("a.h5", [] { std::abort(); }); }),
            "a.h5: is damaged (HDF5 failed to read it: it was ended by signal 6)");
}

TEST(Hdf5Trial, AnErrorComesAsItIsAndNothingOfASuccess) {
  EXPECT_EQ(test::message_of([] { try_hdf5("a.h5", [] { throw Error("wrong"); }); }), "wrong");
  bool read = false;
  try_hdf5("a.h5", [&read] { read = true; });
  EXPECT_FALSE(read);
}

TEST(Hdf5Trial, WhatIsReadAfterItsTrialComesBack) {
  int calls = 0;  // of this process
  EXPECT_EQ(read_hdf5("a.h5", [&calls] { return ++calls; }), 1);
  EXPECT_THROW(read_hdf5("a.h5", [&calls]() -> int { throw Error(std::to_string(++calls)); }), Error);
  EXPECT_EQ(calls, 1) << "what fails in its trial isn't called again";
}

}  // namespace
}  // namespace touchstone
