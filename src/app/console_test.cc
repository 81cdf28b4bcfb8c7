#include "app/console.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <functional>
#include <string>
#include <utility>

#include "support/temporary_folder.h"

namespace trammel::app {
namespace {

// Exit codes of the children.
constexpr int kAsItShould = 0, kThrew = 10, kOtherwise = 11;

/// Runs in a process of its own, whose streams may be spoilt; -signal where one ended it.
int InAProcess(const std::function<int()>& work) {
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGPIPE, SIG_DFL);
    try {
      _exit(work());
    } catch (const std::exception&) {
      _exit(kThrew);
    }
  }
  int status = 0;
  if (waitpid(child, &status, 0) != child) return kOtherwise;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

void SayMuch() {
  for (int i = 0; i < 1000; ++i) {
    fmt::print("line {:04} of many that are said\n", i);
    fmt::print(stderr, "and a word aside\n");
    std::fflush(stdout);
  }
}

TEST(GuardedConsole, OutlivesAReaderThatHasGone) {
  EXPECT_EQ(InAProcess([] {
              int ends[2];
              if (pipe(ends) != 0) return kOtherwise;
              dup2(ends[1], STDOUT_FILENO);
              dup2(ends[1], STDERR_FILENO);
              close(ends[0]);
              GuardConsole();
              SayMuch();
              return FinishConsole() ? kAsItShould : kOtherwise;
            }),
            kAsItShould);
}

TEST(GuardedConsole, SaysInTheEndThatADiskIsFull) {
  EXPECT_EQ(InAProcess([] {
              dup2(open("/dev/full", O_WRONLY), STDOUT_FILENO);
              GuardConsole();
              SayMuch();
              const auto said = FinishConsole();
              if (said) return kOtherwise;
              return said.error().message.find("No space left") != std::string::npos ? kAsItShould
                                                                                     : kOtherwise;
            }),
            kAsItShould);
}

TEST(GuardedConsole, WaitsForNobodyWhileAMachineMoves) {
  EXPECT_EQ(InAProcess([] {
              alarm(60);  // ends the test if it blocks
              int ends[2];
              if (pipe(ends) != 0) return kOtherwise;
              fcntl(ends[1], F_SETPIPE_SZ, 4096);  // fills at once: nobody reads yet
              dup2(ends[1], STDOUT_FILENO);
              close(ends[1]);
              GuardConsole();
              {
                const ConsoleDoesNotWait moving;
                SayMuch();
              }
              const pid_t reader = fork();
              if (reader == 0) {
                close(STDOUT_FILENO);
                std::string all;
                char piece[1000];
                for (ssize_t n = 0; (n = read(ends[0], piece, sizeof piece)) > 0;) {
                  all.append(piece, static_cast<std::size_t>(n));
                }
                const std::size_t line =
                    fmt::format("line {:04} of many that are said\n", 0).size();
                _exit(all.size() == 1000 * line && all.ends_with("0999 of many that are said\n")
                          ? kAsItShould
                          : kOtherwise);
              }
              if (!FinishConsole()) return kOtherwise;
              close(STDOUT_FILENO);
              int status = -1;
              waitpid(reader, &status, 0);
              return WIFEXITED(status) ? WEXITSTATUS(status) : kOtherwise;
            }),
            kAsItShould);
}

TEST(GuardedConsole, LastWordsWaitForNoTerminalThatNobodyReads) {
  for (const std::size_t room : {1, 100, 511}) {
    EXPECT_EQ(InAProcess([room] {
                alarm(60);  // ends the test if it blocks
                const int reader = posix_openpt(O_RDWR | O_NOCTTY);
                if (reader < 0 || grantpt(reader) != 0 || unlockpt(reader) != 0) return kOtherwise;
                const int terminal = open(ptsname(reader), O_RDWR | O_NOCTTY | O_NONBLOCK);
                if (terminal < 0) return kOtherwise;
                while (write(terminal, "x", 1) == 1) continue;  // full
                std::string read_again(room, ' ');
                if (read(reader, read_again.data(), room) <= 0) return kOtherwise;
                fcntl(terminal, F_SETFL, O_RDWR);  // blocking, as a shell sets it
                dup2(terminal, STDOUT_FILENO);
                GuardConsole();
                WaitForNoReaderAnyMore();
                SayMuch();
                (void)FinishConsole();
                const bool shared_as_it_was = (fcntl(STDOUT_FILENO, F_GETFL) & O_NONBLOCK) == 0;
                return shared_as_it_was ? kAsItShould : kOtherwise;
              }),
              kAsItShould)
        << room;
  }
}

TEST(GuardedConsole, LetsNoFileTakeThePlaceOfAClosedStream) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() / "results";
  EXPECT_EQ(InAProcess([&] {
              close(STDIN_FILENO);
              close(STDOUT_FILENO);
              close(STDERR_FILENO);
              GuardConsole();
              const int file = open(path.c_str(), O_WRONLY | O_CREAT, 0600);
              SayMuch();
              return FinishConsole() && file > STDERR_FILENO ? kAsItShould : kOtherwise;
            }),
            kAsItShould);
  EXPECT_EQ(test::ReadWhole(path), "");
}

/// Returns the output on both streams of a process.
std::pair<std::string, std::string> StreamsOf(const std::function<void()>& work) {
  const test::TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder.path() / name).string(); };
  const int code = InAProcess([&] {
    dup2(open(path("out").c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
    dup2(open(path("err").c_str(), O_WRONLY | O_CREAT, 0600), STDERR_FILENO);
    GuardConsole();
    work();
    return FinishConsole() ? kAsItShould : kOtherwise;
  });
  EXPECT_EQ(code, kAsItShould);
  return {test::ReadWhole(path("out")), test::ReadWhole(path("err"))};
}

TEST(GuardedConsole, SaysErrorsAndTheAnswerOnlyWhenQuiet) {
  const auto say = [] {
    fmt::print("answer\n");
    fmt::print(stderr, "  heating (about {} s)\n", 30);
    fmt::print(stderr, "trammel: {}\n", "no such file");
    fmt::print(stderr, "note: {}\n", "trammel: no error");
  };
  const auto [answer, errors] = StreamsOf([&] {
    PrintErrorsOnly();
    say();
  });
  EXPECT_EQ(answer, "answer\n");
  EXPECT_EQ(errors, "trammel: no such file\n");
  EXPECT_NE(StreamsOf(say).second.find("heating"), std::string::npos);
}

TEST(GuardedConsole, ColoursVerdictsOnTerminalsAndWhereItIsToldTo) {
  const auto said = [](Colour when) {
    return StreamsOf([when] {
             ColourVerdicts(when);
             fmt::print("verdict  good\n");
           })
        .first;
  };
  EXPECT_EQ(said(Colour::kAlways), "verdict  \x1b[32mgood\x1b[0m\n");
  EXPECT_EQ(said(Colour::kNever), "verdict  good\n");
  EXPECT_EQ(said(Colour::kAuto), "verdict  good\n");  // a file
  for (const bool unwanted : {false, true}) {
    const int terminal = posix_openpt(O_RDWR | O_NOCTTY);
    ASSERT_TRUE(terminal >= 0 && grantpt(terminal) == 0 && unlockpt(terminal) == 0);
    const std::string name = ptsname(terminal);
    const int held = open(name.c_str(), O_RDWR | O_NOCTTY);
    ASSERT_GE(held, 0);
    EXPECT_EQ(InAProcess([&] {
                dup2(held, STDOUT_FILENO);
                setenv("TERM", "xterm", 1);
                if (unwanted) {
                  setenv("NO_COLOR", "1", 1);
                } else {
                  unsetenv("NO_COLOR");
                }
                GuardConsole();
                ColourVerdicts(Colour::kAuto);
                fmt::print("verdict  good\n");
                return FinishConsole() ? kAsItShould : kOtherwise;
              }),
              kAsItShould);
    std::string shown(100, '\0');
    shown.resize(static_cast<std::size_t>(std::max<ssize_t>(0, read(terminal, shown.data(), 100))));
    EXPECT_EQ(shown.find("\x1b[32mgood") == std::string::npos, unwanted) << shown;
    close(held);
    close(terminal);
  }
}

TEST(GuardedConsole, ShowsWhatATerminalWouldObey) {
  const test::TemporaryFolder folder;
  const std::string path = folder.path() / "out";
  EXPECT_EQ(InAProcess([&] {
              dup2(open(path.c_str(), O_WRONLY | O_CREAT, 0600), STDOUT_FILENO);
              GuardConsole();
              fmt::print("{}\n", "camera \x1b]0;owned\a says \xC3");
              for (const char byte : std::string("°C\n")) {  // byte by byte
                fmt::print("{}", byte);
                std::fflush(stdout);
              }
              return FinishConsole() ? kAsItShould : kOtherwise;
            }),
            kAsItShould);
  EXPECT_EQ(test::ReadWhole(path), "camera \\u001b]0;owned\\u0007 says \xEF\xBF\xBD\n°C\n");
}

TEST(VerdictColour, IsThatOfTheWordAloneAndOfNothingElse) {
  EXPECT_EQ(WithColouredVerdicts("a\nverdict    good\nb\n", true),
            "a\nverdict    \x1b[32mgood\x1b[0m\nb\n");
  EXPECT_EQ(WithColouredVerdicts("verdict  cannot tell", true),
            "verdict  \x1b[33mcannot tell\x1b[0m");
  EXPECT_EQ(WithColouredVerdicts("verdict   refused: it is torn\n", true),
            "verdict   \x1b[31mrefused\x1b[0m: it is torn\n");
  EXPECT_EQ(WithColouredVerdicts("  acceleration    cannot tell: too few lines\n", true),
            "  acceleration    \x1b[33mcannot tell\x1b[0m: too few lines\n");
  EXPECT_EQ(WithColouredVerdicts("12:30  refused   good  tap.json\n", true),
            "12:30  \x1b[31mrefused\x1b[0m   good  tap.json\n");
  for (const char* plain : {"", "\n", "verdict", "verdict ", "verdict \n", "verdict  goods\n",
                            "\"verdict\": \"good\"\n", "verdict  good enough\n", "verdictgood\n",
                            "notice  good enough\n", "  it was refused: torn\n", "  goods  \n"}) {
    EXPECT_EQ(WithColouredVerdicts(plain, true), plain);
  }
  EXPECT_EQ(WithColouredVerdicts("verdict  good\nverdict  good\n", false),
            "verdict  good\nverdict  \x1b[32mgood\x1b[0m\n");
}

}  // namespace
}  // namespace trammel::app
