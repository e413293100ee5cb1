#include "fem/error/compliance_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tbb/global_control.h>
#include <xxhash.h>

#include <Eigen/SparseCore>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <set>
#include <thread>

#include "core/error.h"
#include "core/whole_file.h"
#include "fem/elements/compliance_file.h"
#include "tests/support/run_words.h"
#include "tests/support/temporary_folder.h"

namespace touchstone::fem {
namespace {

using ::testing::HasSubstr;

class ComplianceCache : public ::testing::Test {
 protected:
  SlabMesh slab{4.0, 4.0, 2.0, 1.0, 2.0, 1.0, 1.0, 0.5};
  ElasticMaterial material{0.33, 0.49};
  std::vector<Bead> beads = {{{0.1, 0.2, -0.9}, 0.25}, {{-0.5, 0.2, -0.9}, 0.2}};
  touchstone::test::TemporaryFolder folder;
  int computed = 0;  // times that elasticity was solved

  Compliance get() {
    return cached_compliance(slab, material, beads, folder.path(),
                             [&](const std::string& stage, std::int64_t done, std::int64_t total) {
                               computed += stage == "elasticity" && done == total;
                             });
  }
  // Places in the file (fem/elements/compliance_file.h).
  static constexpr std::size_t kFormatAt = 8;
  static constexpr std::size_t kFileSizeAt = 80;
  static constexpr std::size_t kSurfaceAt = 104;  // its offset
  static constexpr std::size_t kChecksumAt = 152;
  static constexpr std::size_t kHeaderSize = 168;

  /// The content with the checksum that belongs to it.
  static std::string sealed(std::string content) {
    const std::string summed = content.substr(0, kChecksumAt) + content.substr(kHeaderSize);
    XXH128_canonical_t sum;
    XXH128_canonicalFromHash(&sum, XXH3_128bits(summed.data(), summed.size()));
    std::memcpy(content.data() + kChecksumAt, &sum, sizeof(sum));
    return content;
  }
  std::filesystem::path file() const { return compliance_file(folder.path(), compliance_key(slab, material, beads)); }
  static void expect_same(const BodyErrors& a, const BodyErrors& b) {
    EXPECT_EQ(a.radius_per_edge, b.radius_per_edge);
    ASSERT_EQ(a.errors.size(), b.errors.size());
    for (std::size_t k = 0; k < a.errors.size(); ++k) EXPECT_EQ(a.errors[k].values, b.errors[k].values);
    EXPECT_EQ(a.mesh_order.values, b.mesh_order.values);
    EXPECT_EQ(a.size_order.values, b.size_order.values);
  }
  static void expect_same(const Compliance& a, const Compliance& b) {
    EXPECT_EQ(a.thickness, b.thickness);
    EXPECT_EQ(a.material.youngs_modulus, b.material.youngs_modulus);
    EXPECT_EQ(a.material.poisson_ratio, b.material.poisson_ratio);
    EXPECT_EQ(a.vertices, b.vertices);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(Eigen::MatrixXd(a.mass), Eigen::MatrixXd(b.mass));
    EXPECT_TRUE(a.surface.view() == b.surface.view());
    EXPECT_TRUE(a.beads.view() == b.beads.view());
    EXPECT_EQ(a.report.unknowns, b.report.unknowns);
    EXPECT_EQ(a.report.tetrahedra, b.report.tetrahedra);
    EXPECT_EQ(a.report.smallest_dihedral_deg, b.report.smallest_dihedral_deg);
    expect_same(a.mesh_error.smooth, b.mesh_error.smooth);
    expect_same(a.mesh_error.sharp, b.mesh_error.sharp);
  }
  /// The file is spoilt; the next call must notice, make it anew, say why, and leave a sound file.
  void expect_rebuilt(const std::string& spoilt, const std::string& reason) {
    const Compliance good = get();
    const std::string before = read_whole_file(file());
    write_whole_file(file(), spoilt);
    computed = 0;
    const Compliance again = get();
    EXPECT_EQ(computed, 1);
    EXPECT_THAT(again.report.note, HasSubstr(reason));
    EXPECT_THAT(again.report.note, HasSubstr(file().string()));
    expect_same(again, good);
    EXPECT_EQ(read_whole_file(file()), before);
    computed = 0;
    EXPECT_EQ(get().report.note, "");
    EXPECT_EQ(computed, 0);
  }
};

TEST_F(ComplianceCache, SecondTimeIsReadBackBitForBit) {
  const Compliance first = get();
  EXPECT_EQ(computed, 1);
  EXPECT_TRUE(std::filesystem::exists(file()));
  const Compliance second = get();
  EXPECT_EQ(computed, 1);
  EXPECT_EQ(second.report.note, "");
  expect_same(first, second);
}

TEST_F(ComplianceCache, GelWithoutBeadsIsReadBackToo) {
  beads.clear();
  const Compliance first = get();
  expect_same(first, get());
  EXPECT_EQ(computed, 1);
}

TEST_F(ComplianceCache, EachParameterHasItsOwnFile) {
  std::set<std::string> keys = {compliance_key(slab, material, beads)};
  std::size_t expected = 1;
  double* const parameters[] = {&slab.size_x,
                                &slab.size_y,
                                &slab.thickness,
                                &slab.fine,
                                &slab.coarse,
                                &slab.fine_half_x,
                                &slab.fine_half_y,
                                &slab.fine_depth,
                                &material.youngs_modulus,
                                &material.poisson_ratio,
                                &beads[0].centre.x(),
                                &beads[0].centre.y(),
                                &beads[1].centre.z(),
                                &beads[1].radius};
  for (double* parameter : parameters) {
    *parameter += 1e-9;
    keys.insert(compliance_key(slab, material, beads));
    EXPECT_EQ(keys.size(), ++expected);
  }
  beads.pop_back();
  keys.insert(compliance_key(slab, material, beads));
  EXPECT_EQ(keys.size(), ++expected);
  std::swap(slab.size_x, slab.thickness);
  keys.insert(compliance_key(slab, material, beads));
  EXPECT_EQ(keys.size(), ++expected);
}

TEST_F(ComplianceCache, GelsThatDifferInModulusAreMadeFromOne) {
  const Compliance alone = get();
  const Compliance direct = compute_compliance(mesh_slab(slab), material, beads, slab.thickness);
  EXPECT_EQ(computed, 1);
  // Only rounding tells it from what elasticity gives at its own modulus.
  EXPECT_LT((alone.surface.view() - direct.surface.view()).norm(), 1e-13 * direct.surface.view().norm());
  EXPECT_LT((alone.beads.view() - direct.beads.view()).norm(), 1e-13 * direct.beads.view().norm());
  EXPECT_EQ(alone.material.youngs_modulus, material.youngs_modulus);

  std::filesystem::remove(file());
  material.youngs_modulus = 1.0;
  get();
  material.youngs_modulus = alone.material.youngs_modulus;
  const int once = computed;
  expect_same(get(), alone);
  material.youngs_modulus = 2.0;
  const Compliance stiff = get();
  EXPECT_EQ(computed, once);  // both from the one of 1 MPa
  EXPECT_LT((stiff.surface.view() * (2.0 / 0.33) - alone.surface.view()).norm(), 1e-14 * alone.surface.view().norm());
  expect_same(stiff.mesh_error.smooth, alone.mesh_error.smooth);

  // A damaged one isn't believed.
  material.youngs_modulus = 1.0;
  write_whole_file(file(), "spoilt");
  material.youngs_modulus = 3.0;
  get();
  EXPECT_EQ(computed, once + 1);
}

TEST_F(ComplianceCache, NegativeZeroIsZero) {
  beads[0].centre.x() = 0.0;
  const std::string key = compliance_key(slab, material, beads);
  beads[0].centre.x() = -0.0;
  EXPECT_EQ(compliance_key(slab, material, beads), key);
}

TEST_F(ComplianceCache, AnyChangedByteIsNoticed) {
  get();
  const std::string content = read_whole_file(file());
  const Compliance good = get();
  // All of the header and of the end; in between some hundred places, the padding between the parts among them.
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < 200; ++k) {
    places.insert(places.end(), {k, content.size() - 1 - k, 4095 - 3 * k, (content.size() / 200) * k});
  }
  for (const std::size_t place : places) {
    std::string spoilt = content;
    spoilt[place] = static_cast<char>(spoilt[place] ^ 1);
    write_whole_file(file(), spoilt);
    EXPECT_THROW(read_compliance(file(), compliance_key(slab, material, beads)), Error) << place;
  }
  std::string spoilt = content;
  spoilt[content.size() / 2] = static_cast<char>(spoilt[content.size() / 2] ^ 1);
  expect_rebuilt(spoilt, "its checksum is wrong");
}

TEST_F(ComplianceCache, TruncatedFileIsMadeAnew) {
  get();
  const std::string content = read_whole_file(file());
  expect_rebuilt(content.substr(0, content.size() - 1), "it ends early");
  expect_rebuilt(content.substr(0, content.size() - 5000), "it ends early");
  expect_rebuilt(content.substr(0, 40), "it ends early");
  expect_rebuilt(content + "more", "it is longer than it should be");
  expect_rebuilt("", "it isn't a compliance");
}

TEST_F(ComplianceCache, OtherVersionIsMadeAnew) {
  get();
  std::string content = read_whole_file(file());
  --content[kFormatAt];
  expect_rebuilt(sealed(content), fmt::format("it has format {}", kComplianceFormat - 1));
  // What format 1 looked like: the same magic and place of the number, the key and a body right after it.
  std::string old = "TSCOMPLY";
  old += std::string("\1\0\0\0", 4) + compliance_key(slab, material, beads) + std::string(100000, '\3');
  expect_rebuilt(old, "it has format 1");
}

TEST_F(ComplianceCache, FileOfAnotherGelIsMadeAnew) {
  get();
  const std::string other = read_whole_file(file());
  material.youngs_modulus = 0.5;
  expect_rebuilt(other, "it belongs to another gel");
}

TEST_F(ComplianceCache, FileOfAnotherKindIsMadeAnew) {
  expect_rebuilt(std::string(100000, 'x'), "it isn't a compliance");
}

TEST_F(ComplianceCache, SoundSealOnAnUnsoundHeaderIsMadeAnew) {
  get();
  const std::string content = read_whole_file(file());
  // The header's numbers from the body's offset on, each made far too large, then a little wrong.
  for (std::size_t place = kFileSizeAt + 8; place < kChecksumAt; place += 8) {
    std::string huge = content;
    huge[place + 7] = 0x7f;
    expect_rebuilt(sealed(huge), "it");
    std::string off = content;
    off[place] = static_cast<char>(off[place] + 8);
    write_whole_file(file(), sealed(off));
    EXPECT_THROW(read_compliance(file(), compliance_key(slab, material, beads)), Error) << place;
  }
}

// Whoever may write into the folder can seal a file as the program does.
TEST_F(ComplianceCache, SoundSealOnNumbersThatArentAGelsIsMadeAnew) {
  get();
  const std::string content = read_whole_file(file());
  const double bad = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t surface = 0;
  std::memcpy(&surface, content.data() + kSurfaceAt, sizeof(surface));
  constexpr std::size_t kFirstVertexAt = kHeaderSize + 4 * 8;
  for (const std::size_t place : {kHeaderSize, kHeaderSize + 8, kHeaderSize + 16, kFirstVertexAt, surface + 80}) {
    std::string spoilt = content;
    std::memcpy(spoilt.data() + place, &bad, sizeof(bad));
    expect_rebuilt(sealed(spoilt), "it has numbers that aren't a gel's");
  }
}

// Eigen takes rows of a sparse matrix in order for granted. libFuzzer found a file without.
TEST_F(ComplianceCache, SoundSealOnRowsOutOfOrderIsMadeAnew) {
  const Compliance good = get();
  const std::string content = read_whole_file(file());
  const std::size_t vertices_end = kHeaderSize + 4 * 8 + 24 * good.vertices.size();
  const std::size_t triangles_end = vertices_end + 8 + 12 * good.triangles.size();
  const std::size_t rows_at = triangles_end + 8 + 4 * (good.vertices.size() + 1) + 8;
  std::array<std::int32_t, 2> first{};
  std::memcpy(first.data(), content.data() + rows_at, sizeof(first));
  ASSERT_EQ(first[0], good.mass.innerIndexPtr()[0]);
  ASSERT_EQ(first[1], good.mass.innerIndexPtr()[1]);
  for (const std::array<std::int32_t, 2> wrong : {std::array{first[1], first[0]}, std::array{first[0], first[0]}}) {
    std::string spoilt = content;
    std::memcpy(spoilt.data() + rows_at, wrong.data(), sizeof(wrong));
    expect_rebuilt(sealed(spoilt), "its matrices don't fit its vertices");
  }
}

TEST_F(ComplianceCache, MatricesLieInTheMappedFileAndOutliveItsName) {
  const Compliance first = get();
  const Compliance second = get();
  EXPECT_EQ(reinterpret_cast<std::uintptr_t>(second.surface.view().data()) % 4096, 0u);
  const Compliance made = cached_compliance(slab, material, beads, {});
  std::filesystem::remove(file());
  expect_same(second, made);
  write_whole_file(file(), "another file of that name");
  expect_same(second, made);
  const Compliance copy = second;
  EXPECT_EQ(copy.surface.view().data(), second.surface.view().data());
}

constexpr const char* kMakersFolder = "TOUCHSTONE_TEST_MAKERS_FOLDER";

/// Not a test by itself: what the processes of the next one do.
TEST_F(ComplianceCache, DISABLED_OneOfSeveralMakers) {
  const char* const shared = std::getenv(kMakersFolder);
  ASSERT_NE(shared, nullptr);
  const Compliance one = cached_compliance(slab, material, beads, shared);
  EXPECT_EQ(one.report.note, "");
  EXPECT_GT(one.surface.rows(), 0);
}

/// Makers in one process. AddressSanitizer's allocator (of gcc 12) isn't safe over fork(), as glibc's is:
/// TetGen's process would wait for ever for a lock that a thread of its parent held.
#ifdef __SANITIZE_ADDRESS__
constexpr int kThreads = 1;
#else
constexpr int kThreads = 4;
#endif

TEST_F(ComplianceCache, MakersAtTheSameTimeAllEndWithASoundFile) {
  const std::string self = std::filesystem::read_symlink("/proc/self/exe").string();
  std::array<touchstone::test::ProgramRun, 2> processes;
  std::vector<Compliance> made(kThreads);
  {
    std::vector<std::jthread> makers;
    for (touchstone::test::ProgramRun& process : processes) {
      makers.emplace_back([&] {
        process = touchstone::test::run_words(
            {"/usr/bin/env", std::string(kMakersFolder) + "=" + folder.path().string(), self,
             "--gtest_also_run_disabled_tests", "--gtest_filter=ComplianceCache.DISABLED_OneOfSeveralMakers"});
      });
    }
    for (Compliance& one : made) {
      makers.emplace_back([&] { one = cached_compliance(slab, material, beads, folder.path()); });
    }
  }
  for (const touchstone::test::ProgramRun& process : processes) {
    EXPECT_EQ(process.exit_code, 0) << process.out << process.err;
    EXPECT_THAT(process.out, HasSubstr("[  PASSED  ] 1 test."));
  }
  const Compliance alone = cached_compliance(slab, material, beads, {});
  for (const Compliance& one : made) {
    expect_same(one, alone);
    EXPECT_EQ(one.report.note, "");
  }
  expect_same(get(), alone);
  EXPECT_EQ(computed, 0);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder.path()), {}), 1);  // no temporary file is left
}

TEST_F(ComplianceCache, FileHasTheSameBytesFromOneThreadAndFromMany) {
  slab.fine = 0.4;
  get();
  const std::string many = read_whole_file(file());
  std::filesystem::remove(file());
  const tbb::global_control one_thread(tbb::global_control::max_allowed_parallelism, 1);
  get();
  EXPECT_TRUE(read_whole_file(file()) == many);
}

TEST_F(ComplianceCache, FileIsAsLargeAsPredicted) {
  const Compliance gel = get();
  const double size = static_cast<double>(std::filesystem::file_size(file()));
  EXPECT_NEAR(compliance_file_bytes(static_cast<int>(gel.vertices.size()), 2), size, 3 * 4096.0);
}

TEST_F(ComplianceCache, FolderIsMadeAndEmptyPathKeepsNothing) {
  const auto deeper = folder.path() / "a" / "b";
  cached_compliance(slab, material, beads, deeper);
  EXPECT_TRUE(std::filesystem::exists(compliance_file(deeper, compliance_key(slab, material, beads))));
  EXPECT_EQ(cached_compliance(slab, material, beads, {}).report.note, "");
}

TEST_F(ComplianceCache, FolderThatCantBeWrittenIsSaidButNoError) {
  const auto blocked = folder.write("a-file", "not a folder");
  const Compliance gel = cached_compliance(slab, material, beads, blocked / "cache");
  EXPECT_THAT(gel.report.note, HasSubstr("couldn't be kept"));
  EXPECT_GT(gel.surface.rows(), 0);
}

TEST_F(ComplianceCache, BadGelIsRefusedAndLeavesNothing) {
  material.poisson_ratio = 0.7;
  EXPECT_THROW(get(), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

}  // namespace
}  // namespace touchstone::fem
