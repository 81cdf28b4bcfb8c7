#include "pressure_advance/commands/pressure_advance_job.h"

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
  const auto offer =
      PressureAdvanceJob().check(PlaceWithPetg(), {{"filament", "PLA+"}, {"temp", "241.5"}});
  ASSERT_TRUE(offer) << offer.error().message;
  EXPECT_THAT(offer->question, HasSubstr("nozzle 241.5"));
  EXPECT_EQ(offer->start, (Arguments{{"filament", "pla__2b"}, {"temp", "241.5"}}));
  EXPECT_EQ(PressureAdvanceJob().settings.at("temp"), "filament.nozzle_temperature");
}

TEST(PressureAdvanceJob, ATemperatureThatIsNoPlainNumberOrOutOfRangeIsRefused) {
  for (const char* text : {"", "1e3", " 240", "240 M112", "240\nbed_temperature = 1", "2400000",
                           "nan", "-5", "90", "501", "2.4.0", "."}) {
    EXPECT_FALSE(PressureAdvanceJob().check(PlaceWithPetg(), {{"temp", text}})) << text;
  }
}

TEST(PressureAdvanceJob, TheDialogNamesSpoolmanWhereTheSettingsWriteThere) {
  for (const service::JobKind& kind : {PressureAdvanceJob(), PhotoJob()}) {
    service::PrinterPlace place = PlaceWithPetg();
    EXPECT_EQ(kind.use_also(place), "");
    place.set = {"moonraker.keep_in_spoolman=true"};
    EXPECT_EQ(kind.use_also(place), "keep it in Spoolman");
  }
}

}  // namespace
}  // namespace trammel::app
