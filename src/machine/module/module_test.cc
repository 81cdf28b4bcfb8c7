#include "machine/module/module.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <string>

#include "support/matchers.h"
#include "support/sweep_world.h"

namespace trammel::machine {
namespace {

using ::testing::HasSubstr;

constexpr ModuleName kNone = {"trammel-none", "reading tea leaves", "trammel-leaves",
                              "libtea1 libleaf2"};

TEST(Module, NamesWhereItLookedForOneThatIsNotThere) {
  const std::array<std::filesystem::path, 2> folders = {"/nowhere/a", "/nowhere/b"};
  const auto module = LoadModule(kNone, folders);
  ASSERT_FALSE(module);
  EXPECT_THAT(module.error().message,
              Containing("reading tea leaves needs the module trammel-none.so",
                         "/nowhere/a and /nowhere/b", "install the package trammel-leaves"));
}

/// The error of a module in a folder.
std::string ErrorIn(const std::filesystem::path& folder) {
  const std::array<std::filesystem::path, 1> folders = {folder};
  return ErrorOf(LoadModule(kNone, folders));
}

TEST(Module, RefusesOneOfAnotherVersionOrUserOrThatAnybodyMayWrite) {
  const test::TemporaryFolder folder;
  const auto path = folder.path() / "trammel-none.so";
  std::filesystem::copy(TRAMMEL_STRANGE_MODULE, path);
  EXPECT_THAT(ErrorIn(folder.path()), HasSubstr("another version"));
  std::filesystem::remove(path);  // loaded modules are cached by path
  const auto again = folder.path() / "again";
  std::filesystem::create_directories(again);
  std::filesystem::copy(TRAMMEL_STRANGE_MODULE, again / "trammel-none.so");
  std::filesystem::permissions(again / "trammel-none.so", std::filesystem::perms::all);
  EXPECT_THAT(ErrorIn(again), Containing("trammel-none.so", "others may write to it"));
  std::filesystem::permissions(again / "trammel-none.so", std::filesystem::perms::owner_all);
  if (chown((again / "trammel-none.so").c_str(), 12345, 12345) != 0) GTEST_SKIP() << "not root";
  EXPECT_THAT(ErrorIn(again), HasSubstr("not the program's owner's"));
}

// Whoever can write a folder above can put another file in its place.
TEST(Module, RefusesOneBelowAFolderThatOthersMayWrite) {
  const test::TemporaryFolder folder;
  const auto open = folder.path() / "open";
  const auto lib = open / "lib";
  std::filesystem::create_directories(lib);
  std::filesystem::copy(TRAMMEL_STRANGE_MODULE, lib / "trammel-none.so");
  using std::filesystem::perms;
  for (const perms others : {perms::others_write, perms::group_write}) {
    std::filesystem::permissions(open, perms::owner_all | others);
    if (others == perms::group_write && chown(open.c_str(), static_cast<uid_t>(-1), 12345) != 0) {
      GTEST_SKIP() << "not root: the folder cannot be given to another group";
    }
    EXPECT_THAT(ErrorIn(lib), Containing(open.string() + " is not the program's owner's",
                                         "install trammel anew"));
  }
  // Permissions of /tmp.
  std::filesystem::permissions(open, perms::all | perms::sticky_bit);
  EXPECT_THAT(ErrorIn(lib), HasSubstr("another version"));
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
