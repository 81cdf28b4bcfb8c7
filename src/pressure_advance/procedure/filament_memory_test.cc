#include "pressure_advance/procedure/filament_memory.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "session/fake_printer.h"

namespace trammel::procedure {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using Json = nlohmann::json;

// Keeps what it is told to, as Klipper does.
class KeepingPrinter : public testing::FakePrinter {
 public:
  KeepingPrinter() {
    told["save_variables"]["variables"] = Json::object();
    told["configfile"]["settings"]["extruder"]["nozzle_diameter"] = 0.4;
  }
  Result<void> Run(std::string_view script, const machine::WaitLimit& limit) override {
    auto done = FakePrinter::Run(script, limit);
    for (const std::string name : {"trammel_pa", "trammel_pa_before"}) {
      const std::string start = "SAVE_VARIABLE VARIABLE=" + name + " VALUE=\"";
      if (forgets || !done || !script.starts_with(start)) continue;
      std::string literal(script.substr(start.size(), script.size() - start.size() - 1));
      for (char& c : literal) c = c == '\'' ? '"' : c;
      told["save_variables"]["variables"][name] = Json::parse(literal);
    }
    return done;
  }
  bool forgets = false;
};

Session SessionOf(machine::Printer& printer) { return {printer, {}, {}}; }

TEST(FilamentKey, TellsNamesApartAndHoldsNothingThatKlipperTripsOver) {
  EXPECT_EQ(FilamentKey("Generic PLA").value(), "generic_pla");
  EXPECT_EQ(FilamentKey("  Generic-PLA ").value(), "generic_pla");
  EXPECT_EQ(FilamentKey("PLA+").value(), "pla__2b");
  EXPECT_EQ(FilamentKey("PLA 红").value(), "pla___e7baa2");
  EXPECT_EQ(FilamentKey("50% \"wood\"; ok").value(), "50__25___22wood__22__3b_ok");
  for (const char* name : {"Generic PLA", "PLA+", "PLA 红", "💥"}) {
    const std::string key = FilamentKey(name).value();
    EXPECT_EQ(FilamentKey(key).value(), key);
  }
}

TEST(FilamentKey, RefusesWhatIsNoName) {
  EXPECT_THAT(FilamentKey("  ").error().message, HasSubstr("empty"));
  EXPECT_THAT(FilamentKey("").error().message, HasSubstr("empty"));
  EXPECT_THAT(FilamentKey("a\nG28").error().message, HasSubstr("control character"));
  EXPECT_THAT(FilamentKey(std::string(101, 'x')).error().message, HasSubstr("101 bytes"));
}

TEST(KeepForFilament, KeepsTheValueBesideThoseOfOthers) {
  KeepingPrinter printer;
  printer.told["save_variables"]["variables"]["trammel_pa"] = {
      {"petg", {{"extruder/0.40", 0.05}}}, {"generic_pla", {{"extruder/0.60", 0.0212345}}}};
  const auto place = KeepForFilament(SessionOf(printer), "Generic PLA", 0.01724);
  ASSERT_TRUE(place) << place.error().message;
  EXPECT_EQ(place->filament, "generic_pla");
  EXPECT_EQ(place->nozzle, "extruder/0.40");
  EXPECT_THAT(
      printer.scripts,
      ElementsAre(
          "SAVE_VARIABLE VARIABLE=trammel_pa VALUE=\"{'generic_pla':{'extruder/0.40':0.0172,"
          "'extruder/0.60':0.0212345},'petg':{'extruder/0.40':0.05}}\""));
}

TEST(KeepForFilament, TheValueIsNoneOfTheNozzleBeforeAnyMore) {
  KeepingPrinter printer;
  Json& variables = printer.told["save_variables"]["variables"];
  variables["trammel_pa_before"] = {{"pla", {{"extruder/0.40", 0.05}, {"extruder/0.60", 0.04}}},
                                    {"petg", {{"extruder/0.40", 0.05}}}};
  ASSERT_TRUE(KeepForFilament(SessionOf(printer), "PLA", 0.02));
  EXPECT_EQ(variables["trammel_pa_before"],
            (Json{{"pla", {{"extruder/0.60", 0.04}}}, {"petg", {{"extruder/0.40", 0.05}}}}));
  ASSERT_TRUE(KeepForFilament(SessionOf(printer), "PETG", 0.02));
  EXPECT_EQ(variables["trammel_pa_before"], (Json{{"pla", {{"extruder/0.60", 0.04}}}}));
}

TEST(KeepForFilament, SendsNothingWhereItCannotBeKept) {
  KeepingPrinter printer;
  printer.told["save_variables"]["variables"]["trammel_pa"] = {{"pla", {{"x';y", 0.1}}}};
  EXPECT_THAT(KeepForFilament(SessionOf(printer), "PLA", 0.02).error().message,
              HasSubstr("did not write"));
  printer.told["save_variables"]["variables"]["trammel_pa"] = 5;
  EXPECT_THAT(KeepForFilament(SessionOf(printer), "PLA", 0.02).error().message,
              HasSubstr("did not write"));
  EXPECT_THAT(KeepForFilament(SessionOf(printer), " ", 0.02).error().message, HasSubstr("empty"));
  EXPECT_THAT(KeepForFilament(SessionOf(printer), "PLA", std::nan("")).error().message,
              HasSubstr("within 0 ... 10"));
  printer.told["configfile"]["settings"]["extruder"].clear();
  printer.told["save_variables"]["variables"] = Json::object();
  EXPECT_THAT(KeepForFilament(SessionOf(printer), "PLA", 0.02).error().message,
              HasSubstr("nozzle_diameter"));
  printer.told["save_variables"] = Json::object();
  EXPECT_THAT(KeepForFilament(SessionOf(printer), "PLA", 0.02).error().message,
              HasSubstr("[save_variables]"));
  EXPECT_THAT(printer.scripts, IsEmpty());
}

TEST(KeepForFilament, NoticesAPrinterThatForgets) {
  KeepingPrinter printer;
  printer.forgets = true;
  EXPECT_THAT(KeepForFilament(SessionOf(printer), "PLA", 0.02).error().message,
              HasSubstr("does not tell it again"));
}

// The 1,001st made all of them unreadable.
TEST(KeepForFilament, OneTooManyIsRefusedAndThoseThatAreThereGoOn) {
  KeepingPrinter printer;
  Json& kept = printer.told["save_variables"]["variables"]["trammel_pa"];
  for (int i = 0; i < 1000; ++i) kept[fmt::format("f{}", i)] = {{"extruder/0.40", 0.05}};
  const auto refused = KeepForFilament(SessionOf(printer), "PLA", 0.02);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("1000 filaments have a pressure advance there"));
  EXPECT_THAT(printer.scripts, IsEmpty());
  EXPECT_TRUE(KeepForFilament(SessionOf(printer), "F7", 0.02));
  kept["one_more"] = {{"extruder/0.40", 0.05}};  // as written by an earlier version
  EXPECT_TRUE(KeepForFilament(SessionOf(printer), "F7", 0.03));
}

}  // namespace
}  // namespace trammel::procedure
