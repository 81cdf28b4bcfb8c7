#include "part_alignment/files/stl_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <string>

#include "part_alignment/files/part_fit_file.h"
#include "part_alignment/mesh/mesh_test_support.h"
#include "support/matchers.h"
#include "support/run_trammel.h"
#include "support/temporary_folder.h"

namespace trammel::files {
namespace {

namespace fs = std::filesystem;

using part_alignment::Triangle;
using part_alignment::TriangleMesh;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

void PutWord(std::string& bytes, std::uint32_t word) {
  for (int i = 0; i < 4; ++i) bytes.push_back(static_cast<char>((word >> (8 * i)) & 0xffU));
}

std::string Binary(const TriangleMesh& mesh, std::string header = "") {
  header.resize(80, ' ');
  std::string bytes = header;
  PutWord(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    bytes.append(12, '\0');
    for (const std::uint32_t v : t) {
      for (const double x : mesh.vertices_mm[v]) {
        PutWord(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(x)));
      }
    }
    bytes.append(2, '\0');
  }
  return bytes;
}

std::string Text(const TriangleMesh& mesh, const std::string& head = "solid a part\n") {
  std::string text = head;
  for (const Triangle& t : mesh.triangles) {
    text += "facet normal 0 0 0\n outer loop\n";
    for (const std::uint32_t v : t) {
      const auto& at = mesh.vertices_mm[v];
      text += fmt::format("  vertex {} {:e} {}\n", at.x(), at.y(), at.z());
    }
    text += " endloop\nendfacet\n";
  }
  return text + "endsolid a part\n";
}

const TriangleMesh kBox = part_alignment::test::BoxMesh({40, 25, 15});

void ExpectBox(const Result<TriangleMesh>& mesh) {
  ASSERT_TRUE(mesh) << mesh.error().message;
  EXPECT_EQ(mesh->vertices_mm.size(), 8U) << "equal corners are one vertex";
  ASSERT_EQ(mesh->triangles.size(), 12U);
  for (std::size_t t = 0; t < 12; ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_EQ(mesh->vertices_mm[mesh->triangles[t][k]], kBox.vertices_mm[kBox.triangles[t][k]]);
    }
  }
}

std::string Complaint(const std::string& bytes) { return ErrorOf(ParseStl(bytes, "part.stl", 1)); }

TEST(StlFile, BinaryAndTextGiveTheSameTriangles) {
  ExpectBox(ParseStl(Binary(kBox), "a.stl", 1));
  ExpectBox(ParseStl(Text(kBox), "a.stl", 1));
}

TEST(StlFile, TheContentTellsWhichOfTheTwoItIs) {
  ExpectBox(ParseStl(Binary(kBox, "solid facet normal from a CAD program"), "a.stl", 1));
  ExpectBox(ParseStl(Text(kBox, "\xEF\xBB\xBF \r\n SOLID\r\n"), "a.stl", 1));
  ExpectBox(ParseStl(Text(kBox, "solid\n"), "a.stl", 1));
}

TEST(StlFile, UnitsAreThoseThatAreStated) {
  for (const auto& [name, mm] : {std::pair{"mm", 1.0}, std::pair{"cm", 10.0},
                                 std::pair{"m", 1000.0}, std::pair{"inch", 25.4}}) {
    const auto unit = Must(LengthUnitOf(name));
    const auto mesh = Must(ParseStl(Text(kBox), "a.stl", unit.mm));
    EXPECT_EQ(mesh.vertices_mm[0], Eigen::Vector3d(kBox.vertices_mm[0] * mm)) << name;
  }
  EXPECT_FALSE(LengthUnitOf("furlong"));
}

TEST(StlFile, CutShortIsNamedAtAnyLength) {
  const std::string binary = Binary(kBox);
  for (std::size_t n = 0; n < binary.size(); ++n) {
    const auto mesh = ParseStl(binary.substr(0, n), "part.stl", 1);
    EXPECT_FALSE(mesh) << n;
  }
  EXPECT_THAT(Complaint(binary.substr(0, 400)),
              Containing("12 triangles, which are 684 bytes; it has 400", "cut short"));
  EXPECT_THAT(Complaint(binary.substr(0, 50)), HasSubstr("no STL"));
  const std::string text = Text(kBox);
  for (std::size_t n = 0; n + 17 < text.size(); n += 7) {
    EXPECT_FALSE(ParseStl(text.substr(0, n), "part.stl", 1)) << n;
  }
  EXPECT_THAT(Complaint(text.substr(0, text.find("endloop"))),
              Containing("part.stl:7: the file ends where \"endloop\" is wanted", "cut short"));
}

TEST(StlFile, BytesBehindTheLastTriangleAreSkipped) {
  const std::string binary = Binary(kBox);
  const std::string named = Binary(kBox, "solid by a CAD program");
  for (const std::size_t more : {1, 2, 4, 49, 51, 512, 599}) {
    for (const char filler : {'\0', ' ', '\x1a', '\xff'}) {
      const std::string trailing(more, filler);
      ExpectBox(ParseStl(binary + trailing, "a.stl", 1));
      ExpectBox(ParseStl(named + trailing, "a.stl", 1));
      EXPECT_EQ(StlTrailingBytes(binary + trailing), more);
    }
  }
  EXPECT_EQ(StlTrailingBytes(binary), 0U);
  EXPECT_EQ(StlTrailingBytes(Text(kBox) + "\n\n"), 0U);
}

TEST(StlFile, TrianglesBehindTheStatedOnesAreNeverDropped) {
  const std::string binary = Binary(kBox);
  std::string none = binary;
  none.replace(80, 4, 4, '\0');
  std::string fewer = binary;
  fewer[80] = 10;
  EXPECT_THAT(Complaint(fewer), Containing("states 10 triangles, which are 584 bytes; it has "
                                           "684, 2 triangles more",
                                           "export or copy it anew"));
  EXPECT_THAT(Complaint(none), HasSubstr("states 0 triangles"));
  EXPECT_THAT(Complaint(binary + std::string(601, ' ')), HasSubstr("it has 1285"));
}

TEST(StlFile, WhatIsNoNumberIsNamedWithItsPlace) {
  TriangleMesh mesh = kBox;
  mesh.vertices_mm[7].x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT(Complaint(Binary(mesh)),
              HasSubstr("triangle 3 of 12 has a corner that is no number"));
  EXPECT_THAT(Complaint(Text(mesh)), Containing("part.stl:20", "\"nan\""));
  EXPECT_THAT(Complaint("solid\nfacet normal 0 0 1\nouter loop\nvertex 1,5 0 0\n"),
              Containing("part.stl:4", "\"1,5\""));
}

TEST(StlFile, StatedCountsAreBelievedOnlyWhereTheBytesAreThere) {
  std::string bytes(84, ' ');
  for (std::size_t i = 80; i < 84; ++i) bytes[i] = '\xff';
  EXPECT_THAT(Complaint(bytes), HasSubstr("4294967295 triangles, which are 214748364834 bytes"));
}

class MeshFiles : public testing::Test {
 protected:
  [[nodiscard]] fs::path At(const std::string& name) const { return folder_.path() / name; }
  void Write(const std::string& name, const std::string& bytes) const {
    test::WriteWhole(At(name), bytes);
  }

 private:
  test::TemporaryFolder folder_;
};

TEST_F(MeshFiles, AnUnstatedUnitIsSaidToBeMm) {
  Write("box.stl", Binary(kBox));
  const auto asked = Must(ReadMeshFile(At("box.stl"), std::nullopt, false));
  EXPECT_THAT(asked.notices[0], Containing("12 triangles, 80 × 50 × 30 mm", "states no unit"));
  const auto told = Must(ReadMeshFile(At("box.stl"), LengthUnitOf("inch"), false));
  EXPECT_THAT(told.notices[0],
              AllOf(HasSubstr("2032 × 1270 × 762 mm, read in inch"), Not(HasSubstr("no unit"))));
}

TEST_F(MeshFiles, TenMillionTrianglesAreRefusedUnread) {
  Write("huge.stl", Binary(kBox));
  fs::resize_file(At("huge.stl"), 84 + 50 * 10'000'000ULL);  // no byte of it is on the disk
  EXPECT_THAT(ReadMeshFile(At("huge.stl"), std::nullopt, false),
              FailsWith("huge.stl: 500 MB, 10.0 million triangles", "coarser deflection"));
}

TEST_F(MeshFiles, WhatIsWrongWithTheShellNamesTheFile) {
  TriangleMesh open = kBox;
  open.triangles.pop_back();
  Write("open.stl", Binary(open));
  EXPECT_THAT(ReadMeshFile(At("open.stl"), std::nullopt, false),
              FailsWith("open.stl: the shell is open", "\"open\": true"));
  EXPECT_TRUE(ReadMeshFile(At("open.stl"), std::nullopt, true));
  EXPECT_FALSE(ReadMeshFile(At("nothing.stl"), std::nullopt, false));
}

TEST_F(MeshFiles, APartFileNamesItsMeshFromItsOwnFolder) {
  fs::create_directory(At("cad"));
  Write("cad/box.stl", Text(kBox));
  const auto part = [](const std::string& more) {
    return fmt::format(R"({{"format": 1, "most_uneven_mm": 7, "surfaces": [{{"id": "casting",
      "kind": "mesh", "file": "box.stl", "overstock_mm": 3{}}}]}})",
                       more);
  };
  Write("cad/part.json", part(R"(, "unit": "cm", "most_facet_error_mm": 0.01)"));
  const auto read = Must(ReadPartFile(At("cad/part.json"), ReadMeshFile));
  ASSERT_EQ(read.surfaces.size(), 1U);
  EXPECT_EQ(read.surfaces[0].mesh->mesh().triangles.size(), 12U);
  EXPECT_EQ(read.surfaces[0].max_facet_error_mm, 0.01);
  EXPECT_EQ(read.options.max_uneven_mm, 7);
  EXPECT_THAT(read.notices[0], HasSubstr("800 × 500 × 300 mm, read in cm"));
  Write("cad/part.json", part(R"(, "unit": "furlong")"));
  EXPECT_THAT(ReadPartFile(At("cad/part.json"), ReadMeshFile).error().message, HasSubstr("unit"));
  Write("cad/part.json", part(R"(, "open": 1)"));
  EXPECT_THAT(ReadPartFile(At("cad/part.json"), ReadMeshFile).error().message, HasSubstr("open"));
  Write("cad/part.json", part(R"(, "radius_mm": 1)"));
  EXPECT_THAT(ReadPartFile(At("cad/part.json"), ReadMeshFile).error().message,
              HasSubstr("radius_mm"));
}

}  // namespace
}  // namespace trammel::files
