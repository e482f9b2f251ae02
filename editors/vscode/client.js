// Starts `lexican lsp`, and lets VS Code speak with it.
const { workspace } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

exports.activate = () => {
  const command = workspace.getConfiguration("lexican").get("command");
  const documentSelector = [{ language: "eds" }, { language: "toml" }];
  client = new LanguageClient("lexican", "lexican", { command, args: ["lsp"] }, { documentSelector });
  return client.start();
};

exports.deactivate = () => client?.stop();
