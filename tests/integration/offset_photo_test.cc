// A phone's photo of a small sheet, read, and what cannot be read refused for what is wrong with
// it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "photo_world.h"
#include "support/matchers.h"
#include "tool_offset/offset/analyse.h"

namespace trammel {
namespace {

using ::testing::HasSubstr;

constexpr double kDegree = std::numbers::pi / 180;
constexpr sim::SheetName kName{71, 0, 0};
/// The intervals hold heights and colours; an error beyond twice of one is a fault of the reader.
constexpr double kMaxHalfWidths = 2;
constexpr double kWorst_mm = 0.025;

// Printed once for all: two tools, nine teeth, laid out for a photo of 3 MP.
class OffsetPhoto : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    pattern_ = std::make_unique<PatternFile>(WritePattern(Settings()));
    sheet_ = std::make_unique<sim::PrintedSheet>(PrintPattern(pattern_->gcode, kName));
  }
  static void TearDownTestSuite() {
    pattern_.reset();
    sheet_.reset();
  }

  static tool_offset::SheetSettings Settings() {
    tool_offset::SheetSettings settings;
    settings.teeth = 9;
    settings.filament.material = "pla";
    settings.for_photo = true;
    return settings;
  }
  static sim::PhoneTraits Phone() {
    sim::PhoneTraits phone = sim::DrawPhone(*sheet_, Random(5));
    phone.width_px /= 2;
    phone.height_px /= 2;
    phone.focal_px /= 2;
    phone.centre_x_px /= 2;
    phone.centre_y_px /= 2;
    phone.tilt_rad = 9 * kDegree;
    return phone;
  }
  static Result<tool_offset::SheetResult> See(const sim::PhoneTraits& phone) {
    return SeePhoto(*pattern_, *sheet_, phone, kName, 0);
  }
  static void ExpectNear(const Measured& measured, double truth_mm) {
    ASSERT_TRUE(measured.good()) << measured.reason();
    const Quantity& quantity = measured.quantity();
    const double half_mm = (quantity.interval95.hi - quantity.interval95.lo) / 2;
    EXPECT_LT(std::abs(quantity.value - truth_mm), kMaxHalfWidths * half_mm);
    EXPECT_LT(std::abs(quantity.value - truth_mm), kWorst_mm);
  }
  static void ExpectRight(const tool_offset::SheetResult& result) {
    const auto truth = Must(sim::OffsetOf(*sheet_, 1, 0));
    ExpectNear(result.tools[0].dx_mm, truth.x_mm);
    ExpectNear(result.tools[0].dy_mm, truth.y_mm);
    ExpectNear(result.backlash_mm.x, sheet_->backlash_mm[0]);
    ExpectNear(result.backlash_mm.y, sheet_->backlash_mm[1]);
  }

  static std::unique_ptr<PatternFile> pattern_;
  static std::unique_ptr<sim::PrintedSheet> sheet_;
};
std::unique_ptr<PatternFile> OffsetPhoto::pattern_;
std::unique_ptr<sim::PrintedSheet> OffsetPhoto::sheet_;

TEST_F(OffsetPhoto, OneIsRightAndTwoAreMoreCertain) {
  const sim::PhoneTraits phone = Phone();
  const auto one = Must(See(phone));
  ExpectRight(one);
  ASSERT_TRUE(one.photo);
  EXPECT_NEAR(one.photo->pose.tilt_rad, phone.tilt_rad, kDegree);
  const auto two =
      Must(SeePhoto(*pattern_, *sheet_, TakenAgain(*sheet_, phone, Random(6)), kName, 1));
  const tool_offset::SheetResult joined =
      tool_offset::JoinPhotos(pattern_->plan, std::vector{one, two});
  ExpectRight(joined);
  EXPECT_LT(joined.tools[0].dx_mm.quantity().standard_uncertainty,
            one.tools[0].dx_mm.quantity().standard_uncertainty);
}

TEST_F(OffsetPhoto, ACroppedPictureIsNoticedAndItsIntervalsAreWider) {
  sim::PhoneTraits phone = Phone();
  const auto whole = Must(See(phone));
  phone.width_px = 1901;
  phone.height_px = 1471;
  phone.shift_x_px = 60;
  phone.shift_y_px = -30;
  const auto cropped = Must(See(phone));
  ExpectRight(cropped);
  EXPECT_THAT(cropped.notices, testing::Contains(HasSubstr("no camera stores")));
  EXPECT_GT(cropped.tools[0].dx_mm.quantity().standard_uncertainty,
            whole.tools[0].dx_mm.quantity().standard_uncertainty);
}

TEST_F(OffsetPhoto, WhatCannotBeReadIsRefusedForWhatIsWrongWithIt) {
  struct Unfit {
    const char* wanted;
    void (*change)(sim::PhoneTraits&);
  };
  for (const Unfit& unfit : {Unfit{"part of a box", [](auto& phone) { phone.shift_x_px = 700; }},
                             Unfit{"blurred", [](auto& phone) { phone.blur_px = 3.2; }},
                             Unfit{"blurred", [](auto& phone) { phone.blur_px = 8; }},
                             Unfit{"px per mm", [](auto& phone) { phone.distance_mm *= 1.5; }},
                             Unfit{"aslant",
                                   [](auto& phone) {
                                     phone.tilt_rad = 38 * kDegree;
                                     phone.distance_mm *= 0.8;
                                   }},
                             Unfit{"ultra-wide", [](auto& phone) {
                                     phone.distance_mm *= 800 / phone.focal_px;
                                     phone.focal_px = 800;
                                     phone.radial = {-0.2, 0, 0};
                                   }}}) {
    sim::PhoneTraits phone = Phone();
    unfit.change(phone);
    EXPECT_THAT(See(phone), FailsWith(unfit.wanted)) << unfit.wanted;
  }
}

TEST_F(OffsetPhoto, GlareOverAStructureIsNamed) {
  sim::PhoneTraits phone = Phone();
  phone.glare = 1.5;
  phone.glare_x = 0.12;
  phone.glare_y = 0.1;
  phone.glare_size = 0.03;
  const auto result = Must(See(phone));
  int drowned = 0;
  for (const tool_offset::StructureReading& structure : result.structures) {
    drowned += structure.offset_mm.reason().find("lamp's reflection") != std::string::npos;
  }
  EXPECT_GE(drowned, 1);
}

}  // namespace
}  // namespace trammel
