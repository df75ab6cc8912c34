// Starts `skillwing language-server` for the skillset files of the workspace.

"use strict";

const fs = require("node:fs");
const path = require("node:path");
const vscode = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

/** @type {LanguageClient | undefined} */
let client;

/** The program to run: the one in the settings, or that of the workspace's own Python environment. */
function command() {
  const configured = vscode.workspace.getConfiguration("skillwing").get("command", "skillwing");
  if (configured !== path.basename(configured)) {
    return configured;
  }
  const [folder, name] = process.platform === "win32" ? ["Scripts", `${configured}.exe`] : ["bin", configured];
  const own = (vscode.workspace.workspaceFolders ?? [])
    .filter((root) => root.uri.scheme === "file")
    .map((root) => path.join(root.uri.fsPath, ".venv", folder, name));
  return own.find((candidate) => fs.existsSync(candidate)) ?? configured;
}

async function start() {
  const program = command();
  client = new LanguageClient(
    "skillwing",
    "Skillwing",
    { command: program, args: ["language-server"] },
    { documentSelector: [{ language: "skillset" }, { language: "robot-language" }] },
  );
  try {
    await client.start();
  } catch (error) {
    client = undefined;
    void vscode.window.showErrorMessage(
      `\`${program} language-server\` could not be started. Install it with \`pip install 'skillwing[editor]'\`, ` +
        `or set \`skillwing.command\`. (${error.message ?? error})`,
    );
  }
}

async function stop() {
  const running = client;
  client = undefined;
  await running?.stop();
}

async function restart() {
  await stop();
  await start();
}

async function activate(context) {
  context.subscriptions.push(
    vscode.commands.registerCommand("skillwing.restart", restart),
    vscode.workspace.onDidChangeConfiguration(async (change) => {
      if (change.affectsConfiguration("skillwing.command")) {
        await restart();
      }
    }),
  );
  await start();
}

module.exports = { activate, deactivate: stop };
