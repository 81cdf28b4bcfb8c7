#include "pressure_advance/commands/pressure_advance_commands.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace trammel::app {
namespace {

using service::Arguments;
using ::testing::HasSubstr;

service::PrinterPlace PlaceWithPetg() {
  service::PrinterPlace place;
  place.material = "petg";
  return place;
}

TEST(PressureAdvanceJob, OffersTheTemperatureOfThisRunAndHandsItOn) {
  const auto offer = PressureAdvanceJob().check(PlaceWithPetg(),
                                                {{"filament", "PLA+"}, {"temp", "241.5"}}, nullptr);
  ASSERT_TRUE(offer) << offer.error().message;
  EXPECT_THAT(offer->question, HasSubstr("nozzle 241.5"));
  EXPECT_EQ(offer->start,
            (Arguments{{"filament", "pla__2b"}, {"material", "pla"}, {"temp", "241.5"}}));
}

TEST(PressureAdvanceJob, AFilamentIsHeatedAsTheMaterialInItsName) {
  service::PrinterPlace place;
  place.material = "pla";
  for (const service::JobKind& kind : {PressureAdvanceJob(), PhotoPatternJob()}) {
    const auto petg = kind.check(place, {{"filament", "PETG Jet"}}, nullptr);
    ASSERT_TRUE(petg) << petg.error().message;
    EXPECT_THAT(petg->question, HasSubstr("(petg: nozzle 235, bed 85 degC)"));
    EXPECT_EQ(petg->start.at("material"), "petg");  // and so is the run
    // An unknown filament is heated by the settings, and a given material takes precedence.
    EXPECT_THAT(kind.check(place, {{"filament", "Jet Black"}}, nullptr)->question,
                HasSubstr("(pla: "));
    EXPECT_THAT(
        kind.check(place, {{"filament", "PETG Jet"}, {"material", "abs"}}, nullptr)->question,
        HasSubstr("(abs: "));
  }
  place.material.clear();
  place.set = {"filament.material=pla", "filament.nozzle_temperature=205"};
  const auto other = PressureAdvanceJob().check(place, {{"filament", "PETG Jet"}}, nullptr);
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message, HasSubstr("nozzle_temperature = 205 for pla"));
  EXPECT_TRUE(
      PressureAdvanceJob().check(place, {{"filament", "PETG Jet"}, {"temp", "240"}}, nullptr));
  EXPECT_TRUE(PressureAdvanceJob().check(place, {{"filament", "PLA Jet"}}, nullptr));
}

TEST(PressureAdvanceJob, ATemperatureThatIsNoPlainNumberOrOutOfRangeIsRefused) {
  for (const char* text : {"", "1e3", " 240", "240 M112", "240\nbed_temperature = 1", "2400000",
                           "nan", "-5", "90", "501", "2.4.0", "."}) {
    EXPECT_FALSE(PressureAdvanceJob().check(PlaceWithPetg(), {{"temp", text}}, nullptr)) << text;
  }
}

TEST(PressureAdvanceJob, TheDialogNamesSpoolmanWhereTheSettingsWriteThere) {
  for (const service::JobKind& kind : {PressureAdvanceJob(), PhotoJob()}) {
    service::PrinterPlace place = PlaceWithPetg();
    EXPECT_EQ(kind.use(place, {}), "Use it until Klipper restarts");
    place.set = {"moonraker.keep_in_spoolman=true"};
    EXPECT_EQ(
        kind.use(place, {{"filament", "PLA"}}),
        "Use it until Klipper restarts, and keep it for filament pla, and keep it in Spoolman");
  }
}

}  // namespace
}  // namespace trammel::app
