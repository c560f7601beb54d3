/** The reward editor: Python, completion of the keys of params, mistakes where they are. Loaded when it is needed. */
import { autocompletion, type CompletionContext } from "@codemirror/autocomplete";
import { python } from "@codemirror/lang-python";
import { HighlightStyle, syntaxHighlighting } from "@codemirror/language";
import { lintGutter, setDiagnostics } from "@codemirror/lint";
import { Compartment } from "@codemirror/state";
import { EditorView, hoverTooltip } from "@codemirror/view";
import { tags } from "@lezer/highlight";
import { basicSetup } from "codemirror";
import { t } from "../i18n/index.svelte";
import { paramAt, PARAMS, type Param } from "./params";

interface Mistake {
  line: number;
  column: number;
  severity: string;
  message: string;
}

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
      ".cm-param": { padding: "8px 12px", maxWidth: "340px", fontFamily: "var(--font)" },
      ".cm-param span": { marginLeft: "10px", color: "var(--quiet)", fontFamily: "var(--mono)" },
      ".cm-tooltip": { backgroundColor: "var(--card)", border: "1px solid var(--line)", borderRadius: "8px" },
    },
    { dark: isDark },
  );

function complete(context: CompletionContext) {
  const word = context.matchBefore(/params\[["']\w*|params\.get\(["']\w*/);
  if (!word) return null;
  const from = word.from + word.text.search(/\w*$/);
  const names = Object.keys(PARAMS) as Param[];
  return {
    from,
    options: names.map((name) => ({ label: name, type: "property", detail: PARAMS[name], info: t(`param_${name}`) })),
  };
}

/** What a key of params says, where the pointer rests on it. */
const explain = hoverTooltip((view, position) => {
  const line = view.state.doc.lineAt(position);
  const found = paramAt(line.text, position - line.from);
  if (!found) return null;
  const create = () => {
    const dom = document.createElement("div");
    dom.className = "cm-param";
    const [head, type, text] = [
      document.createElement("strong"),
      document.createElement("span"),
      document.createElement("p"),
    ];
    [head.textContent, type.textContent, text.textContent] = [found.name, PARAMS[found.name], t(`param_${found.name}`)];
    dom.append(head, type, text);
    return { dom };
  };
  return { pos: line.from + found.from, end: line.from + found.to, above: true, create };
});

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
      explain,
      theme.of(look(false)),
      EditorView.cspNonce.of(nonce),
      EditorView.contentAttributes.of({ "aria-label": label }),
      EditorView.updateListener.of((update) => update.docChanged && onChange(update.state.doc.toString())),
    ],
  });
  view.scrollDOM.tabIndex = 0; // so that the keyboard can scroll long code without editing it
  const show = (mistakes: Mistake[]) => {
    const lines = view.state.doc.lines;
    const found = mistakes
      .filter(({ line }) => line > 0)
      .map((mistake) => {
        const line = view.state.doc.line(Math.min(mistake.line, lines));
        const severity = mistake.severity === "error" ? ("error" as const) : ("warning" as const);
        const at = line.from + Math.max(mistake.column, 1) - 1;
        return { from: at < line.to ? at : line.from, to: line.to, severity, message: mistake.message };
      });
    view.dispatch(setDiagnostics(view.state, found));
  };
  const paint = (isDark: boolean) => view.dispatch({ effects: theme.reconfigure(look(isDark)) });
  return { view, show, paint };
}
