// Blocks whose STEP is written here, read by the module.
#include "machine/cad/step_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>

#include "support/matchers.h"
#include "support/step_text.h"
#include "support/temporary_folder.h"

namespace trammel::machine {
namespace {

using Eigen::Vector3d;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class StepFile : public testing::Test {
 protected:
  [[nodiscard]] Result<StepSolid> Read(const std::string& text,
                                       const StepReadOptions& options = {}) const {
    test::WriteWhole(folder_.path() / "part.step", text);
    return ReadStepFile(folder_.path() / "part.step", options);
  }
  [[nodiscard]] std::string Complaint(const std::string& text) const { return ErrorOf(Read(text)); }
  [[nodiscard]] static std::string Replaced(std::string text, const std::string& from,
                                            const std::string& to) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }

 private:
  test::TemporaryFolder folder_;
};

double Volume_mm3(const StepSolid& solid) {
  double six = 0;
  for (const auto& t : solid.triangles) {
    six += solid.vertices_mm[t[0]].dot(solid.vertices_mm[t[1]].cross(solid.vertices_mm[t[2]]));
  }
  return six / 6;
}

Vector3d Extent_mm(const StepSolid& solid) {
  Vector3d low = solid.vertices_mm.front();
  Vector3d high = low;
  for (const Vector3d& at : solid.vertices_mm) {
    low = low.cwiseMin(at);
    high = high.cwiseMax(at);
  }
  return high - low;
}

TEST_F(StepFile, ABlockIsTheSameInAllUnits) {
  const test::StepBlock block;
  for (const char* unit : {"mm", "cm", "m", "inch"}) {
    const auto solid = Must(Read(test::StepText({block}, unit)));
    EXPECT_EQ(solid.unit, unit);
    EXPECT_EQ(solid.faces, 7U);
    EXPECT_THAT(solid.notices, IsEmpty());
    constexpr double kRounding_mm = 1e-9;
    EXPECT_LT((Extent_mm(solid) - block.size_mm).norm(), kRounding_mm) << unit;
    const double bore_mm3 =
        std::numbers::pi * block.bore_radius_mm * block.bore_radius_mm * block.size_mm.y();
    // Chords lie within the bore's metal by 2/3 of the chord error.
    const double chords_mm3 =
        2 * std::numbers::pi * block.bore_radius_mm * block.size_mm.y() * solid.chord_error_mm;
    EXPECT_NEAR(Volume_mm3(solid), block.size_mm.prod() - bore_mm3, chords_mm3);
  }
}

TEST_F(StepFile, CoordinatesAreThoseThatAreWritten) {
  // The first placement is an item of the shape beside the solid, and moves nothing.
  const std::string text = test::StepText({{}}, "mm");
  const auto plain = Read(text);
  const auto placed = Read(
      Replaced(text, "CARTESIAN_POINT('',(0.000000000000000,0.000000000000000,0.000000000000000))",
               "CARTESIAN_POINT('',(7.,8.,9.))"));
  ASSERT_TRUE(plain && placed);
  EXPECT_EQ(plain->vertices_mm, placed->vertices_mm);
}

TEST_F(StepFile, LiftsLeadFromTheTrianglesToTheSurface) {
  test::StepBlock block;
  block.freeform = true;
  const auto solid = Must(Read(test::StepText({block}, "mm")));
  int over_bore = 0;
  int over_top = 0;
  const Vector3d axis_mm(block.bore_x_mm, 0, block.bore_z_mm);
  for (std::size_t i = 0; i < solid.triangles.size(); ++i) {
    const auto& t = solid.triangles[i];
    const StepLift& lift = solid.lifts[i];
    const Vector3d& a = solid.vertices_mm[t[0]];
    const Vector3d& b = solid.vertices_mm[t[1]];
    const Vector3d& c = solid.vertices_mm[t[2]];
    const Vector3d up = (b - a).cross(c - a).normalized();
    const Vector3d middle = (a + b + c) / 3;
    const double at_middle_mm =
        4.0 / 9 * double(lift.middle_mm[0] + lift.middle_mm[1] + lift.middle_mm[2]);
    const Vector3d lifted = middle + at_middle_mm * up;
    constexpr double kSame_mm = 1e-4;  // and what is stated to be left
    const auto from_axis = [&](const Vector3d& at) {
      return std::hypot(at.x() - axis_mm.x(), at.z() - axis_mm.z());
    };
    if (std::abs(from_axis(a) - block.bore_radius_mm) < 1e-6 && std::abs(up.y()) < 0.5 &&
        std::abs(from_axis(middle) - block.bore_radius_mm) < 0.1) {
      ++over_bore;
      EXPECT_NEAR(from_axis(lifted), block.bore_radius_mm,
                  kSame_mm + static_cast<double>(lift.left_mm));
    } else if (up.z() > 0.3) {
      ++over_top;
      const auto top = test::TopAt(block, lifted.x() / block.size_mm.x() + 0.5,
                                   lifted.y() / block.size_mm.y() + 0.5);
      EXPECT_NEAR((lifted - top.at_mm).dot(top.outward), 0,
                  kSame_mm + static_cast<double>(lift.left_mm));
    }
    EXPECT_LT(lift.left_mm, 0.001F);
  }
  EXPECT_GT(over_bore, 50);
  EXPECT_GT(over_top, 1000);
}

TEST_F(StepFile, ExactlyOneSolidIsTaken) {
  test::StepBlock second;
  second.name = "clamp";
  second.at_mm = {200, 0, 0};
  EXPECT_THAT(Complaint(test::StepText({{}, second}, "mm")),
              Containing("part.step: 2 solids where one is wanted", "\"block\" 80 × 50 × 30 mm",
                         "\"clamp\" 80 × 50 × 30 mm about (200.000", "export the part alone"));
  EXPECT_THAT(Complaint(test::StepText({{}}, "mm", test::StepFault::kNoTop)),
              Containing("its shell is open: 4 edges", "30.000) mm", "close the solid"));
  EXPECT_THAT(Complaint(test::StepText({{}}, "mm", test::StepFault::kSurfacesOnly)),
              Containing("surfaces only (7 faces)", "knit them to a solid"));
  EXPECT_THAT(Complaint(test::StepText({}, "mm")), HasSubstr("holds no solid"));
}

TEST_F(StepFile, WhatTakesOpenCascadeMinutesIsGivenUpInTime) {
  // Open CASCADE takes the square of a list's length.
  std::string list = "#100000=CARTESIAN_POINT('',(0.";
  for (int k = 1; k < 400'000; ++k) list += ",0.";
  list += "));\n";
  StepReadOptions options;
  EXPECT_EQ(options.max_s, 60);
  options.max_s = 2;
  const std::string text = Replaced(test::StepText({{}}, "mm"), "DATA;", "DATA;\n" + list);
  const auto begun = std::chrono::steady_clock::now();
  const auto read = Read(text, options);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begun;
  ASSERT_THAT(read, FailsWith("2 s"));
  constexpr double kBusy_s = 20;
  EXPECT_LT(took.count(), kBusy_s);
}

TEST_F(StepFile, AUnitIsKnownOrRefused) {
  const std::string mm = test::StepText({{}}, "mm");
  EXPECT_THAT(Complaint(Replaced(mm, ".MILLI.,.METRE.", ".MIMLI.,.METRE.")), HasSubstr("damaged"));
  EXPECT_THAT(Complaint(Replaced(mm, "ASSIGNED_CONTEXT((#1,#2,#3))", "ASSIGNED_CONTEXT((#2,#3))")),
              HasSubstr("states no unit of length"));
  EXPECT_THAT(Complaint(Replaced(mm, "GLOBAL_UNIT_ASSIGNED_CONTEXT((#1,#2,#3))", "")),
              HasSubstr("context_of_items"));
}

TEST_F(StepFile, WhatIsNoStepNeverReachesTheReader) {
  const std::string text = test::StepText({{}}, "mm");
  EXPECT_THAT(Complaint(text.substr(0, text.size() / 2)), HasSubstr("cut short"));
  EXPECT_THAT(Complaint("solid block\n"), HasSubstr("no STEP file"));
  EXPECT_THAT(Complaint("PK\x03\x04"), HasSubstr("unpack it first"));
  EXPECT_FALSE(ReadStepFile("/nowhere/part.step"));
}

TEST_F(StepFile, FacesThatDoNotMeetAreRefused) {
  // One corner of the block half a millimetre aside of its three faces.
  EXPECT_THAT(Complaint(Replaced(test::StepText({{}}, "mm"),
                                 "(40.00000000000000,25.00000000000000,0.000000000000000)",
                                 "(40.50000000000000,25.50000000000000,0.500000000000000)")),
              Containing("do not meet", "repair it"));
}

TEST_F(StepFile, EntitiesThatReferToThemselvesAreRefused) {
  const std::string text = test::StepText({{}}, "mm");
  EXPECT_FALSE(Read(Replaced(text, "#9=AXIS2_PLACEMENT_3D('',#6", "#9=AXIS2_PLACEMENT_3D('',#9")));
  const std::size_t at = text.find("=EDGE_LOOP('',(") + 15;
  const std::size_t end = text.find_first_of(",)", at);
  const std::size_t line = text.rfind('#', at - 1);
  const std::string self = text.substr(line, text.find('=', line) - line);
  EXPECT_FALSE(Read(std::string(text).replace(at, end - at, self)));
}

TEST_F(StepFile, AHugeFileIsRefusedUnread) {
  test::TemporaryFolder folder;
  const auto path = folder.path() / "huge.step";
  test::WriteWhole(path, "ISO-10303-21;");
  std::filesystem::resize_file(path, 300'000'000);  // sparse
  const auto read = ReadStepFile(path);
  ASSERT_FALSE(read);
  EXPECT_THAT(read.error().message, Containing("300 MB; 100 MB are read at most", "export"));
}

}  // namespace
}  // namespace trammel::machine
