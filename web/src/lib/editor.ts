/** The reward editor: Python, completion of the keys of params, mistakes where they are. Loaded when it is needed. */
import { autocompletion, type CompletionContext } from "@codemirror/autocomplete";
import { python } from "@codemirror/lang-python";
import { HighlightStyle, syntaxHighlighting } from "@codemirror/language";
import { lintGutter, setDiagnostics } from "@codemirror/lint";
import { Compartment } from "@codemirror/state";
import { EditorView, keymap } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { basicSetup } from "codemirror";
import { PARAMS } from "./params";

interface Mistake { line: number; column: number; severity: string; message: string }

const colours = HighlightStyle.define([
  { tag: [tags.keyword, tags.operatorKeyword, tags.bool, tags.null], color: "var(--accent)" },
  { tag: [tags.string, tags.special(tags.string)], color: "var(--good)" },
  { tag: tags.comment, color: "var(--quiet)", fontStyle: "italic" },
  { tag: [tags.function(tags.variableName), tags.definition(tags.variableName)], fontWeight: "600" },
]);

const look = (isDark: boolean) =>
  EditorView.theme(
    {
      "&": { backgroundColor: "var(--page)", color: "var(--ink)" },
      ".cm-gutters": { backgroundColor: "var(--page)", color: "var(--quiet)", border: "none" },
      ".cm-activeLine, .cm-activeLineGutter": { backgroundColor: "color-mix(in srgb, var(--ink) 5%, transparent)" },
      ".cm-cursor": { borderLeftColor: "var(--ink)" },
      ".cm-tooltip": { backgroundColor: "var(--card)", border: "1px solid var(--line)", borderRadius: "8px" },
    },
    { dark: isDark },
  );

function complete(context: CompletionContext) {
  const word = context.matchBefore(/params\[["']\w*|params\.get\(["']\w*/);
  if (!word) return null;
  const from = word.from + word.text.search(/\w*$/);
  return { from, options: PARAMS.map(([label, type, info]) => ({ label, type: "property", detail: type, info })) };
}

export function openEditor(parent: HTMLElement, text: string, label: string, onChange: (text: string) => void) {
  const nonce = document.querySelector<HTMLMetaElement>('meta[name="csp-nonce"]')?.content ?? "";
  const theme = new Compartment();
  const view = new EditorView({
    parent,
    doc: text,
    extensions: [
      basicSetup,
      python(),
      syntaxHighlighting(colours),
      lintGutter(),
      autocompletion({ override: [complete] }),
      keymap.of([]),
      theme.of(look(false)),
      EditorView.cspNonce.of(nonce),
      EditorView.contentAttributes.of({ "aria-label": label }),
      EditorView.updateListener.of((update) => update.docChanged && onChange(update.state.doc.toString())),
    ],
  });
  view.scrollDOM.tabIndex = 0; // so that the keyboard can scroll long code without editing it
  const show = (mistakes: Mistake[]) => {
    const lines = view.state.doc.lines;
    const found = mistakes.map((mistake) => {
      const line = view.state.doc.line(Math.min(Math.max(mistake.line, 1), lines));
      const severity = mistake.severity === "error" ? ("error" as const) : ("warning" as const);
      return { from: line.from, to: line.to, severity, message: mistake.message };
    });
    view.dispatch(setDiagnostics(view.state, found));
  };
  const paint = (isDark: boolean) => view.dispatch({ effects: theme.reconfigure(look(isDark)) });
  return { view, show, paint };
}
