#include "daemon/api/request.h"

#include <gmock/gmock.h>

namespace scanrig {
namespace {

using testing::HasSubstr;
using Type = RequestField::Type;

const std::vector<RequestField> kFields{
    {.name = "name", .description = "", .required = true, .min = 1, .max = 4},
    {.name = "kind", .description = "", .words = {"good", "bad"}},
    {.name = "share", .type = Type::number, .description = "", .min = 0, .max = 1},
    {.name = "count", .type = Type::integer, .description = "", .min = 0, .max = 10},
    {.name = "fast", .type = Type::flag, .description = ""}};

TEST(RequestBody, IsReadIntoTypedValues) {
  Values values;
  ASSERT_TRUE(read_body(R"({"name":"bolt","kind":"good","share":0.5,"count":3,"fast":true})", kFields, values));
  EXPECT_EQ(values.text("name"), "bolt");
  EXPECT_EQ(values.text("kind"), "good");
  EXPECT_EQ(values.number("share"), 0.5);
  EXPECT_EQ(values.integer("count"), 3);
  EXPECT_TRUE(values.flag("fast"));
  EXPECT_FALSE(values.text("count")) << "of another type";
  EXPECT_FALSE(values.has("other"));
}

TEST(RequestBody, AnEmptyOneIsAnEmptyObject) {
  Values values;
  EXPECT_TRUE(read_body(" \n", {}, values));
  EXPECT_EQ(read_body("", kFields, values).error().message, "name: is missing");
}

TEST(RequestBody, WhatDoesNotFitIsRefusedByName) {
  const std::pair<std::string, std::string> wrong[] = {{R"({"name":1})", "name"},
                                                       {R"({"name":""})", "1 to 4 bytes"},
                                                       {R"({"name":"toolong"})", "name"},
                                                       {R"({"name":"a\nb"})", "control"},
                                                       {R"({"name":"a","kind":"so"})", "good, bad"},
                                                       {R"({"name":"a","share":2})", "0 to 1"},
                                                       {R"({"name":"a","share":"1"})", "share"},
                                                       {R"({"name":"a","share":1e999})", "JSON"},
                                                       {R"({"name":"a","count":1.5})", "whole"},
                                                       {R"({"name":"a","count":11})", "count"},
                                                       {R"({"name":"a","count":18446744073709551615})", "count"},
                                                       {R"({"name":"a","fast":1})", "fast"},
                                                       {R"({"name":"a","other":1})", "unknown key"},
                                                       {R"({"name":"a","name":"b"})", "once"},
                                                       {R"([])", "object"},
                                                       {R"({"name":"a"} x)", "JSON"},
                                                       {"{", "JSON"},
                                                       {std::string(1000, '['), "JSON"},
                                                       {"\xff", "JSON"},
                                                       {std::string("{\"name\":\"a\0b\"}", 14), "JSON"}};
  for (const auto& [body, named] : wrong) {
    Values values;
    const auto read = read_body(body, kFields, values);
    ASSERT_FALSE(read) << body;
    EXPECT_EQ(read.error().code, ErrorCode::invalid_input);
    EXPECT_THAT(read.error().message, HasSubstr(named)) << body;
  }
}

TEST(RequestParameter, IsReadFromItsText) {
  EXPECT_EQ(std::get<double>(*parse_value(kFields[2], "0.25")), 0.25);
  EXPECT_EQ(std::get<std::int64_t>(*parse_value(kFields[3], "7")), 7);
  EXPECT_TRUE(std::get<bool>(*parse_value(kFields[4], "true")));
  for (const auto* text : {"", "x", "1x", " 1", "nan", "inf", "2", "-1"})
    EXPECT_FALSE(parse_value(kFields[2], text)) << text;
  for (const auto* text : {"", "1.5", "99999999999999999999"}) EXPECT_FALSE(parse_value(kFields[3], text)) << text;
  EXPECT_FALSE(parse_value(kFields[4], "yes"));
}

}  // namespace
}  // namespace scanrig
