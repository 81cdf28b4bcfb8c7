// Printer's own reports against a print's requirements: each command that prints or sets, on the
// virtual printer.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "machine_shop.h"
#include "support/matchers.h"

namespace trammel::test {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

constexpr int kRefusedForSafety = 4;

class PrinterFacts : public ::testing::Test {
 protected:
  explicit PrinterFacts(ShopOptions options = WithoutCamera()) : shop_(std::move(options)) {}

  [[nodiscard]] ProcessEnd Run(std::vector<std::string> words) const {
    words.insert(words.end(), {"--printer", shop_.address()});
    return shop_.Run(words);
  }
  /// Checks that the command ends before any heating, motion or change, for this cause.
  void ExpectRefused(const std::vector<std::string>& words, const std::string& cause) const {
    const PrinterLook before = shop_.Look();
    EXPECT_THAT(Run(words), Fails(kRefusedForSafety, cause)) << words[1];
    const PrinterLook after = shop_.Look();
    EXPECT_THAT(NotAsItWas(before, after), IsEmpty()) << words[1];
    EXPECT_EQ(after.nozzle_target_c, 0) << words[1];
    EXPECT_EQ(after.print_file, before.print_file) << words[1];
  }
  static std::vector<std::vector<std::string>> AllThatPrint() {
    return {{"pa", "calibrate", "--material", "pla"},
            {"pa", "print", "--material", "pla"},
            {"pa", "print", "--photo", "--material", "pla"},
            {"pa", "validate", "0.03", "--material", "pla"},
            {"pa", "calibrate", "--dry-run", "--material", "pla"}};
  }

  MachineShop shop_;
};

TEST_F(PrinterFacts, ALoweredSpeedLimitIsRefusedByAllThatPrintBeforeAnythingHeats) {
  shop_.Script("SET_VELOCITY_LIMIT VELOCITY=40");
  for (const auto& words : AllThatPrint()) {
    ExpectRefused(words, "the printer's max_velocity is 40 mm/s, and the pattern prints at");
  }
  EXPECT_THAT(Run({"doctor", "--material", "pla"}).standard_output, HasSubstr("FIX  limits"));
}

class PhoneOwner : public PrinterFacts {
 protected:
  static ShopOptions Options() {
    ShopOptions options = WithoutCamera();
    options.klipper.macros.erase("_LASER_ON");
    options.klipper.macros.erase("LASER_OFF");
    return options;
  }
  PhoneOwner() : PrinterFacts(Options()) {}
};

TEST_F(PhoneOwner, NeedsNeitherLaserNorCamera) {
  EXPECT_THAT(Run({"doctor", "--material", "pla"}),
              Prints(0, "tip  camera", "tip  [scan] laser_on_gcode", "trammel pa print --photo"));
  EXPECT_THAT(
      Run({"doctor", "--material", "pla", "--set", "camera.url=/dev/video9"}).standard_output,
      HasSubstr("FIX  camera"));
}

class ThickFilament : public PrinterFacts {
 protected:
  static ShopOptions Options() {
    ShopOptions options = WithoutCamera();
    options.klipper.filament_diameter_mm = 2.85;
    options.klipper.nozzle_diameter_mm = 0.6;
    return options;
  }
  ThickFilament() : PrinterFacts(Options()) {}
};

TEST_F(ThickFilament, FilamentNozzleAndLinesAreThePrintersOwn) {
  const ProcessEnd dry = Run({"pa", "calibrate", "--dry-run", "--material", "pla"});
  ASSERT_THAT(dry, Prints(0, "; bead 0.7425 x 0.25 mm", "of 2.85 mm filament per mm"));
  EXPECT_THAT(dry.standard_error, Containing("filament of 2.85 mm", "nozzle of 0.6 mm"));
  EXPECT_THAT(Run({"doctor", "--material", "pla"}).standard_output,
              Containing(" 2.85 mm\n", " 0.6 mm\n", Not(HasSubstr("FIX  filament"))));
}

class Delta : public PrinterFacts {
 protected:
  static ShopOptions Options() {
    ShopOptions options = WithoutCamera();
    options.klipper.kinematics = "delta";
    options.klipper.axis_minimum_mm = {-120, -120, -5};
    options.klipper.axis_maximum_mm = {120, 120, 300};
    return options;
  }
  Delta() : PrinterFacts(Options()) {}
};

TEST_F(Delta, ItsBedIsRoundAndTheNozzleWaitsWithinTheCircle) {
  const ProcessEnd dry = Run({"pa", "print", "--photo", "--dry-run", "--material", "pla"});
  ASSERT_THAT(dry, Notes("bed_shape = \"ellipse\" (kinematics delta)"));
  EXPECT_THAT(dry.standard_output, Containing("Y-115", Not(HasSubstr("X-115"))));
  ExpectRefused({"pa", "print", "--photo", "--material", "pla", "--set", "bed_shape=rectangle"},
                "set bed_shape = \"ellipse\"");
}

TEST_F(Delta, ItsSettingsAreWrittenAsItStatesThemAndNothingIsOverwritten) {
  ASSERT_THAT(Run({"config", "init", "delta.toml", "--material", "petg"}),
              Prints(0, "trammel doctor --config delta.toml"));
  const std::string text = ReadWhole(shop_.folder() / "delta.toml");
  EXPECT_THAT(text, Containing("\nbed_shape = \"ellipse\"\n", "\nbed_size_x = 240\n",
                               "\nmaterial = 'petg'\n", "\naddress = '" + shop_.address() + "'\n",
                               Not(HasSubstr("filament_diameter"))));  // the default's
  std::istringstream lines(text);
  std::string before;
  for (std::string line; std::getline(lines, line); before = line) {
    const bool sets = !line.empty() && line.front() != '#' && line.front() != '[';
    EXPECT_TRUE(!sets || before.starts_with("# ")) << line;
  }
  EXPECT_THAT(Run({"config", "init", "delta.toml"}), Fails(1, "delta.toml"));
  EXPECT_EQ(ReadWhole(shop_.folder() / "delta.toml"), text);
  // A printer that is not there states nothing.
  EXPECT_THAT(shop_.Run({"config", "init", "none.toml", "--printer", "127.0.0.1:1"}),
              Fails(3, "127.0.0.1:1"));
  EXPECT_FALSE(std::filesystem::exists(shop_.folder() / "none.toml"));
}

class TwoMotors : public PrinterFacts {
 protected:
  static ShopOptions Options() {
    ShopOptions options = WithoutCamera();
    sim::ExtruderStepperConfig belted;
    belted.name = "belted";
    options.klipper.extruder_steppers = {belted};
    return options;
  }
  TwoMotors() : PrinterFacts(Options()) {}
  [[nodiscard]] double Advance_s(const std::string& motor) const {
    double advance_s = -1;
    shop_.With([&](sim::VirtualKlipper& klipper) {
      advance_s = klipper.motors.at(motor).pressure_advance_s;
    });
    return advance_s;
  }
};

TEST_F(TwoMotors, OnOneFilamentBothAreSetAndNamed) {
  const ProcessEnd applied = Run({"pa", "apply", "0.0421"});
  ASSERT_EQ(applied.exit_code, 0) << applied.standard_error;
  EXPECT_EQ(Advance_s("extruder"), 0.0421);
  EXPECT_EQ(Advance_s("extruder_stepper belted"), 0.0421);
  EXPECT_THAT(applied.standard_output,
              HasSubstr("add to [extruder] and [extruder_stepper belted] in printer.cfg"));
  EXPECT_THAT(Run({"pa", "calibrate", "--dry-run", "--material", "pla"}).standard_output,
              HasSubstr("SET_PRESSURE_ADVANCE EXTRUDER=belted ADVANCE="));
  EXPECT_THAT(Run({"doctor", "--material", "pla"}).standard_output,
              HasSubstr("acts on extruder and extruder_stepper belted"));
}

TEST_F(TwoMotors, UndoGivesEachItsOwnOldValueAndNamesIt) {
  shop_.Script("SET_PRESSURE_ADVANCE EXTRUDER=extruder ADVANCE=0.031");
  shop_.Script("SET_PRESSURE_ADVANCE EXTRUDER=belted ADVANCE=0.012");
  ASSERT_EQ(Run({"pa", "apply", "0.0421"}).exit_code, 0);
  const ProcessEnd undone = Run({"pa", "apply", "--undo"});
  ASSERT_EQ(undone.exit_code, 0) << undone.standard_error;
  EXPECT_EQ(Advance_s("extruder"), 0.031);
  EXPECT_EQ(Advance_s("extruder_stepper belted"), 0.012);
  EXPECT_THAT(undone.standard_output,
              Containing("0.0421  ->  0.0310 s on extruder\n",
                         "0.0421  ->  0.0120 s on extruder_stepper belted\n",
                         "[extruder_stepper belted] in printer.cfg:  "
                         "pressure_advance: 0.0120"));
  EXPECT_EQ(Run({"pa", "apply", "--undo"}).exit_code, 1);  // it was taken back
}

class OldKlipper : public PrinterFacts {
 protected:
  static ShopOptions Options() {
    ShopOptions options;
    options.klipper.before_2024 = true;
    options.klipper.minimum_cruise_ratio = 0.95;  // 500 of 10000 mm/s2
    return options;
  }
  OldKlipper() : PrinterFacts(Options()) {}
};

TEST_F(OldKlipper, MayAccelerateAllTheWayWhileItPrintsAndIsAsItWasAfterwards) {
  const PrinterLook before = shop_.Look();
  const auto run = shop_.Calibrate();
  shop_.WaitUntilPrinting(*run);
  shop_.With(
      [](sim::VirtualKlipper& klipper) { EXPECT_LT(klipper.settings.minimum_cruise_ratio, 1e-6); });
  EXPECT_THAT(run->Wait(), Ends(0));
  EXPECT_THAT(shop_.Faulty(before), IsEmpty());
}

}  // namespace
}  // namespace trammel::test
