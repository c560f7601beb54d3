/** What to play with in lessons, by the names that their files say. */
import type { Component } from "svelte";

export const playthings: Record<string, Component> = {};
