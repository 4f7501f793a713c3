#include "daemon/api/access.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "tests/unit/pipeline/storage/scan_samples.h"

namespace scanrig {
namespace {

using testing::HasSubstr;
using testing::Not;

class Tokens : public scan_samples::FolderTest {
 protected:
  std::filesystem::path path() const { return folder_ / "tokens.json"; }
  void write_text(const std::string& text) {
    scan_samples::write_text(path(), text);
    ::chmod(path().c_str(), 0600);
  }
};

TEST_F(Tokens, GiveTheRoleTheyWereMadeFor) {
  TokenFile tokens;
  const auto line = tokens.add("line 1 tablet", Role::operating, "now");
  ASSERT_FALSE(line) << "a space is no part of a name";
  const auto tablet = tokens.add("tablet", Role::operating, "now");
  const auto bench = tokens.add("bench", Role::engineer, "now");
  ASSERT_TRUE(tablet && bench);
  EXPECT_EQ(tokens.role_of(*tablet), Role::operating);
  EXPECT_EQ(tokens.role_of(*bench), Role::engineer);
  EXPECT_NE(*tablet, *bench);
  for (const auto& wrong :
       {std::string(), std::string("scanrig_"), *tablet + "0", tablet->substr(0, tablet->size() - 1)}) {
    EXPECT_FALSE(tokens.role_of(wrong));
  }
}

TEST_F(Tokens, AreNotInTheFileAndTheFileIsForOneUser) {
  TokenFile tokens;
  const auto token = tokens.add("tablet", Role::viewer, "2026-11-21T09:30:00Z");
  ASSERT_TRUE(tokens.write(path()));
  EXPECT_THAT(*read_file(path()), Not(HasSubstr(token->substr(8))));
  struct stat status {};
  ASSERT_EQ(::stat(path().c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600u);
  const auto again = TokenFile::read(path());
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->role_of(*token), Role::viewer);
  EXPECT_EQ(again->records().at(0).created, "2026-11-21T09:30:00Z");
}

TEST_F(Tokens, ARevokedOneIsNothing) {
  TokenFile tokens;
  const auto token = tokens.add("tablet", Role::viewer, "now");
  EXPECT_EQ(tokens.add("tablet", Role::viewer, "now").error().code, ErrorCode::exists);
  ASSERT_TRUE(tokens.revoke("tablet"));
  EXPECT_FALSE(tokens.role_of(*token));
  EXPECT_EQ(tokens.revoke("tablet").error().code, ErrorCode::not_found);
}

TEST_F(Tokens, AFileOthersMayReadIsRefused) {
  ASSERT_TRUE(TokenFile().write(path()));
  for (const mode_t mode : {0640u, 0604u, 0660u, 0620u}) {
    ::chmod(path().c_str(), mode);
    const auto read = TokenFile::read(path());
    ASSERT_FALSE(read) << std::oct << mode;
    EXPECT_EQ(read.error().code, ErrorCode::refused);
    EXPECT_THAT(read.error().message, HasSubstr("chmod 600"));
  }
}

TEST_F(Tokens, AFileThatIsNotThereHasNone) {
  const auto tokens = TokenFile::read(path());
  ASSERT_TRUE(tokens);
  EXPECT_TRUE(tokens->records().empty());
}

TEST_F(Tokens, WhatIsNotAFileOfTokensIsRefusedWhole) {
  const std::string head = R"({"format":"scanrig-tokens","version":1,"tokens":[)";
  for (const std::string& text :
       {std::string(), std::string("[]"), std::string("{}"), head, head + "1]}", head + "{}]}",
        head + R"({"name":"a","role":"king","salt":"00000000000000000000000000000000","sha256":"00"}]})",
        std::string(R"({"format":"scanrig-tokens","version":2,"tokens":[]})")}) {
    write_text(text);
    const auto read = TokenFile::read(path());
    ASSERT_FALSE(read) << text;
    EXPECT_EQ(read.error().code, ErrorCode::invalid_input) << text;
  }
}

TEST_F(Tokens, AFileThatCannotBeWrittenIsAnIoError) {
  EXPECT_EQ(TokenFile().write(folder_ / "nowhere" / "tokens").error().code, ErrorCode::io);
}

}  // namespace
}  // namespace scanrig
