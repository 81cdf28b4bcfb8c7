// trammel pa apply, and taking a value back, on the virtual printer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "machine_shop.h"

namespace trammel::test {
namespace {

using ::testing::HasSubstr;

class Apply : public testing::Test {
 protected:
  static ShopOptions WithoutCamera() {
    ShopOptions options;
    options.with_camera = false;
    return options;
  }
  [[nodiscard]] ProcessEnd Run(std::vector<std::string> words) const {
    words.insert(words.begin(), {"pa", "apply"});
    words.insert(words.end(), {"--printer", shop_.address()});
    return shop_.Run(words);
  }
  [[nodiscard]] double InForce() const { return shop_.Look().settings.at("pressure advance"); }

  MachineShop shop_{WithoutCamera()};
};

TEST_F(Apply, UndoBringsBackWhatWasInForceAndNothingTwice) {
  const ProcessEnd nothing = Run({"--undo"});
  EXPECT_EQ(nothing.exit_code, 1);
  EXPECT_THAT(nothing.standard_error, HasSubstr("notes no value that was set on"));
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.031");
  ASSERT_EQ(Run({"0.047"}).exit_code, 0);
  EXPECT_NEAR(InForce(), 0.047, 1e-6);
  const ProcessEnd looked = Run({"--undo", "--dry-run"});
  EXPECT_EQ(looked.exit_code, 0) << looked.standard_error;
  EXPECT_NEAR(InForce(), 0.047, 1e-6);
  const ProcessEnd undone = Run({"--undo"});
  EXPECT_EQ(undone.exit_code, 0) << undone.standard_error;
  EXPECT_THAT(undone.standard_output, HasSubstr("0.0470  ->  0.0310 s"));
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
  const ProcessEnd twice = Run({"--undo"});
  EXPECT_EQ(twice.exit_code, 1);
  EXPECT_THAT(twice.standard_error, HasSubstr("was taken back"));
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
}

TEST_F(Apply, UndoLeavesAValueThatSomebodySetSince) {
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.031");
  ASSERT_EQ(Run({"0.047"}).exit_code, 0);
  shop_.Script("SET_PRESSURE_ADVANCE ADVANCE=0.06");
  const ProcessEnd refused = Run({"--undo"});
  EXPECT_EQ(refused.exit_code, 4);
  EXPECT_THAT(refused.standard_error, HasSubstr("somebody set another value since"));
  EXPECT_NEAR(InForce(), 0.06, 1e-6);
  EXPECT_EQ(Run({"--undo", "--force"}).exit_code, 0);
  EXPECT_NEAR(InForce(), 0.031, 1e-6);
}

TEST_F(Apply, WantsAValueOrUndoAndNotBoth) {
  EXPECT_EQ(Run({}).exit_code, 1);
  EXPECT_EQ(Run({"0.04", "--undo"}).exit_code, 1);
}

}  // namespace
}  // namespace trammel::test
