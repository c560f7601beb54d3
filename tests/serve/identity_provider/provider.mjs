// A school's provider on this machine, for tests: prints its address, then serves until it is ended.
// Whoever signs in as NAME is NAME of the school, but for those whose name ends in "-elsewhere"; any password is right.
import { createServer } from "node:http";
import { Provider } from "oidc-provider";

const [client_id, client_secret] = process.argv.slice(2);
const server = createServer();
let league; // whose address has another port each time: as it stands in what browsers bring
server.on("request", ({ url }) => {
  const back = new URL(url, "http://localhost").searchParams.get("redirect_uri");
  if (back) league = new URL(back).origin;
});
server.listen(0, "127.0.0.1", () => {
  // called by another name than the league, so that a browser takes them for two sites
  const issuer = `http://localhost:${server.address().port}`;
  const claims = (name) => ({
    sub: name,
    name: `${name} of the school`,
    email: `${name}@${name.endsWith("-elsewhere") ? "elsewhere" : "school"}.example`,
    email_verified: true,
    groups: ["everybody", "pupils"],
  });
  const provider = new Provider(issuer, {
    // of a native client, loopback addresses may have any port
    clients: [
      {
        client_id,
        client_secret,
        application_type: "native",
        redirect_uris: ["http://127.0.0.1/oidc"],
        backchannel_logout_uri: "http://127.0.0.1/api/door/provider/sign-out",
        backchannel_logout_session_required: true,
      },
    ],
    features: { backchannelLogout: { enabled: true } },
    // without its dispatcher, which calls nobody on this machine
    fetch: (url, { dispatcher, ...options }) => fetch(new URL(new URL(url).pathname, league), options),
    findAccount: (_, name) => ({ accountId: name, claims: () => claims(name) }),
    claims: { openid: ["sub"], email: ["email", "email_verified"], profile: ["name", "groups"] },
    subjectTypes: ["public"],
  });
  server.on("request", provider.callback());
  console.log(issuer);
});
