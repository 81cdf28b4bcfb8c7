#include "base/bug_note.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <new>
#include <thread>

#include "base/check.h"

namespace trammel {
namespace {

using ::testing::HasSubstr;

TEST(BugNote, WhatAThreadThrowsIsNotedAndTheProcessGoesOn) {
  EXPECT_FALSE(NoteBug([] {}));
  EXPECT_FALSE(NotedBug());
  std::optional<std::string> said;
  std::thread([&] { said = NoteBug([] { TRAMMEL_CHECK(false, "one = {}", 1); }); }).join();
  EXPECT_THAT(said.value_or(""), HasSubstr("one = 1"));
  EXPECT_TRUE(NoteBug([] { throw std::bad_alloc(); }));
  EXPECT_TRUE(NoteBug([] { throw 5; }));
  EXPECT_EQ(NotedBug(), said) << "the first is the one to report";
}

}  // namespace
}  // namespace trammel
