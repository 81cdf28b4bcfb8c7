#include "machine/module/module.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <string>

#include "support/laser_world.h"

namespace trammel::machine {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr ModuleName kNone = {"trammel-none", "reading tea leaves", "trammel-leaves",
                              "libtea1 libleaf2"};

TEST(Module, NamesWhereItLookedForOneThatIsNotThere) {
  const std::array<std::filesystem::path, 2> folders = {"/nowhere/a", "/nowhere/b"};
  const auto module = LoadModule(kNone, folders);
  ASSERT_FALSE(module);
  EXPECT_THAT(module.error().message,
              AllOf(HasSubstr("reading tea leaves needs the module trammel-none.so"),
                    HasSubstr("/nowhere/a and /nowhere/b"),
                    HasSubstr("install the package trammel-leaves")));
}

TEST(Module, NamesThePackagesWhereItCannotBeLoaded) {
  const test::TemporaryFolder folder;
  test::WriteWhole(folder.path() / "trammel-none.so", "no library");
  const std::array<std::filesystem::path, 1> folders = {folder.path()};
  const auto module = LoadModule(kNone, folders);
  ASSERT_FALSE(module);
  EXPECT_THAT(module.error().message,
              AllOf(HasSubstr("trammel-none.so"), HasSubstr("apt install libtea1 libleaf2")));
}

TEST(Module, RefusesOneThatAnybodyMayWrite) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "trammel-none.so";
  std::filesystem::copy(TRAMMEL_STRANGE_MODULE, path);
  std::filesystem::permissions(path, std::filesystem::perms::all);
  const std::array<std::filesystem::path, 1> folders = {folder.path()};
  const auto module = LoadModule(kNone, folders);
  ASSERT_FALSE(module);
  EXPECT_THAT(module.error().message, HasSubstr("anybody may write to it"));
}

TEST(Module, RefusesOneOfAnotherVersion) {
  const test::TemporaryFolder folder;
  std::filesystem::copy(TRAMMEL_STRANGE_MODULE, folder.path() / "trammel-none.so");
  const std::array<std::filesystem::path, 1> folders = {folder.path()};
  const auto module = LoadModule(kNone, folders);
  ASSERT_FALSE(module);
  EXPECT_THAT(module.error().message, HasSubstr("another version"));
}

TEST(Module, LiesInLibBesideTheProgramsFolderOrItsParent) {
  const auto program = std::filesystem::read_symlink("/proc/self/exe").parent_path();
  const auto folders = ModuleFolders();
  ASSERT_EQ(folders.size(), 2U);
  EXPECT_EQ(folders[0], program.parent_path() / "lib/trammel");
  EXPECT_EQ(folders[1], program.parent_path().parent_path() / "lib/trammel");
}

}  // namespace
}  // namespace trammel::machine
