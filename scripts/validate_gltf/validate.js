// Validates glTF files with the Khronos validator and prints one JSON array: for each file its issues by severity.
// Usage: node validate.js FOLDER_OF_NODE_MODULES FILE...   Exit status 1 where a file has errors.
'use strict';

const fs = require('fs');
const path = require('path');

const [modules, ...files] = process.argv.slice(2);
const validator = require(path.join(path.resolve(modules), 'gltf-validator'));

async function validate(file) {
  const options = { uri: path.basename(file), maxIssues: 1000 };
  const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), options);
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  const { drawCallCount, totalVertexCount, totalTriangleCount } = report.info;
  return { file, numErrors, numWarnings, numInfos, numHints, drawCallCount, totalVertexCount, totalTriangleCount, messages };
}

Promise.all(files.map(validate)).then(
  (reports) => {
    process.stdout.write(JSON.stringify(reports) + '\n');
    process.exitCode = reports.some((report) => report.numErrors > 0) ? 1 : 0;
  },
  (error) => {
    process.stderr.write(`${error}\n`);
    process.exitCode = 2;
  },
);
