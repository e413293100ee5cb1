#include "fem/compliance_cache.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/SparseCore>
#include <set>

#include "core/error.h"
#include "core/sha256.h"
#include "core/whole_file.h"
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
    return cached_compliance(
        slab, material, beads, folder.path(),
        [&](const std::string&, std::int64_t done, std::int64_t total) { computed += done == total; });
  }
  std::filesystem::path file() const { return compliance_file(folder.path(), compliance_key(slab, material, beads)); }
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

TEST_F(ComplianceCache, NegativeZeroIsZero) {
  beads[0].centre.x() = 0.0;
  const std::string key = compliance_key(slab, material, beads);
  beads[0].centre.x() = -0.0;
  EXPECT_EQ(compliance_key(slab, material, beads), key);
}

TEST_F(ComplianceCache, CorruptFileIsMadeAnew) {
  get();
  std::string content = read_whole_file(file());
  content[content.size() / 2] = static_cast<char>(content[content.size() / 2] ^ 1);
  expect_rebuilt(content, "its checksum is wrong");
}

TEST_F(ComplianceCache, TruncatedFileIsMadeAnew) {
  get();
  const std::string content = read_whole_file(file());
  expect_rebuilt(content.substr(0, content.size() - 1000), "its checksum is wrong");
  expect_rebuilt(content.substr(0, 40), "it ends early");
  expect_rebuilt("", "it ends early");
}

TEST_F(ComplianceCache, OtherVersionIsMadeAnew) {
  get();
  std::string content = read_whole_file(file());
  ++content[8];  // the format's number follows the eight letters of the magic
  content.replace(content.size() - 64, 64, sha256_of(content.substr(0, content.size() - 64)));
  expect_rebuilt(content, "it has format 2");
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

TEST_F(ComplianceCache, SoundSealOnAnUnsoundBodyIsMadeAnew) {
  get();
  const std::string content = read_whole_file(file());
  std::string body = content.substr(0, content.size() - 64 - 8);  // short by one number, but sealed
  body += sha256_of(body);
  expect_rebuilt(body, "it ends early");
  body = content.substr(0, content.size() - 64) + "more";
  body += sha256_of(body);
  expect_rebuilt(body, "it is longer than it should be");
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
