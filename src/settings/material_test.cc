#include "settings/material.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/check.h"

namespace trammel::settings {
namespace {

using ::testing::HasSubstr;

TEST(Material, GivesBothTemperaturesAndTheDensity) {
  FilamentSettings filament;
  filament.material = "PLA";
  EXPECT_FALSE(FindTemperatureProblem(filament));
  const PrintTemperatures temperatures = TemperaturesOf(filament);
  EXPECT_EQ(temperatures.nozzle_c, 215);
  EXPECT_EQ(temperatures.bed_c, 60);
  EXPECT_EQ(temperatures.idle_nozzle_c, 155);
  EXPECT_EQ(Density_g_cm3(filament), 1.24);
  EXPECT_EQ(DescribeTemperatures(filament), "pla: nozzle 215, bed 60 degC");
}

TEST(Material, YieldsToTemperaturesThatAreSet) {
  FilamentSettings filament;
  filament.material = "abs";
  filament.nozzle_temperature_c = 240;
  filament.idle_nozzle_temperature_c = 200;
  const PrintTemperatures temperatures = TemperaturesOf(filament);
  EXPECT_EQ(temperatures.nozzle_c, 240);
  EXPECT_EQ(temperatures.bed_c, 110);
  EXPECT_EQ(temperatures.idle_nozzle_c, 200);
  EXPECT_EQ(DescribeTemperatures(filament), "abs: nozzle 240 (set), bed 110 degC");
}

TEST(Material, IsNotNeededWhereBothTemperaturesAreSet) {
  FilamentSettings filament;
  filament.nozzle_temperature_c = 210;
  EXPECT_TRUE(FindTemperatureProblem(filament));
  filament.bed_temperature_c = 0;  // off
  EXPECT_FALSE(FindTemperatureProblem(filament));
  EXPECT_EQ(TemperaturesOf(filament).bed_c, 0);
  EXPECT_EQ(DescribeTemperatures(filament), "nozzle 210, bed 0 degC");
  EXPECT_FALSE(Density_g_cm3(filament));
}

TEST(Material, ThatIsMissingIsAskedForWithWhatEachWouldBeHeatedTo) {
  const auto problem = FindTemperatureProblem({});
  ASSERT_TRUE(problem);
  for (const Material& material : Materials()) {
    EXPECT_THAT(problem->message, HasSubstr(std::string(material.name) + ": nozzle "));
  }
  EXPECT_THAT(problem->message, HasSubstr("--material"));
  EXPECT_THAT(problem->message, HasSubstr("both nozzle_temperature and bed_temperature"));
  EXPECT_THROW((void)TemperaturesOf({}), Bug);
}

TEST(Material, ThatThereIsNotIsNamedEvenWhereTemperaturesAreSet) {
  FilamentSettings filament;
  filament.material = "pla ";
  filament.nozzle_temperature_c = 210;
  filament.bed_temperature_c = 60;
  const auto problem = FindMaterialProblem(filament);
  ASSERT_TRUE(problem);
  EXPECT_EQ(problem->key, "material");
  EXPECT_THAT(problem->message, HasSubstr("\"pla \" is not known; known are pla:"));
}

// Each could be printed by the printer of the defaults, and lies within the settings' own ranges.
TEST(Material, LiesWithinTheRangesOfTheSettings) {
  for (const Material& material : Materials()) {
    FilamentSettings filament;
    filament.nozzle_temperature_c = material.nozzle_temperature_c;
    filament.bed_temperature_c = material.bed_temperature_c;
    filament.filament_density_g_cm3 = material.density_g_cm3;
    EXPECT_FALSE(FindFieldProblems(filament, FilamentFields())) << material.name;
  }
}

}  // namespace
}  // namespace trammel::settings
