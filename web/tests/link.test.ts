import { expect, test } from "vitest";
import { giftOf, isGift, linkTo } from "../src/tab/link";

const PAGE = "https://example.org/racecraft/";
const source = 'def reward_function(params):\n    """Für alle: 🏎."""\n    return params["speed"]\n';

test("a link brings the reward and the track that it was made of", async () => {
  const link = await linkTo(PAGE, { source, track: "oval" });
  expect(link).toMatch(/^https:\/\/example\.org\/racecraft\/#[A-Za-z0-9=&_-]+$/);
  expect(await giftOf(link!)).toEqual({ source, track: "oval" });
});

test("a link does not become too long to be sent", async () => {
  let noise = "";
  for (let i = 0, state = 1; i < 30_000; i++) {
    state = (state * 48271) % 2147483647;
    noise += String.fromCharCode(33 + (state % 90));
  }
  expect(await linkTo(PAGE, { source: noise, track: "oval" })).toBeUndefined();
});

test("what unpacks to more than a reward function is nothing", async () => {
  const link = await linkTo(PAGE, { source: "#".repeat(10_000_000), track: "oval" });
  expect(link!.length).toBeLessThan(16_000);
  expect(await giftOf(link!)).toBeUndefined();
});

test.each([
  "",
  "#",
  "#reward=%%%&track=oval",
  "#reward=AAAA&track=oval",
  "#track=oval",
  "#about",
  `#${"a".repeat(1e6)}`,
])("an address without a gift brings none", async (hash) => expect(await giftOf(PAGE + hash)).toBeUndefined());

test("a link that was cut short is told from an address that brings nothing", async () => {
  const link = (await linkTo(PAGE, { source, track: "oval" }))!;
  expect(isGift(link)).toBe(true);
  const cut = link.slice(0, -9);
  expect(await giftOf(cut)).toBeUndefined();
  expect(isGift(cut)).toBe(true);
  expect(["", "#", "#replay", "#track=oval"].some((hash) => isGift(PAGE + hash))).toBe(false);
});
